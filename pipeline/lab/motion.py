"""Where the units of a response are at the instants that a video shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from pipeline.errors import UserError
from pipeline.lab.setup import Virtual
from pipeline.tracking.arrays import Floats, Mask

_FINEST = 0.3  # px between the instants of an exposure
_MOST = 9


class Motion(NamedTuple):
    """Poses of the units that are present, over the frames.

    Attributes:
        time: (frames,) of the video, at mid-exposure, s.
        pose: (frames, units, 3) at mid-exposure, mm and rad.
        instants: (frames, instants, units, 3) poses that each exposure averages.
    """

    time: Floats
    pose: Floats
    instants: Floats


def motion(response: xr.Dataset, case: int, present: Mask, asked: Virtual) -> Motion:
    """The motion of one structure and case, sampled by the frames.

    Between the samples of the response, a cubic spline; before the start, its first state.

    Args:
        response: of one structure.
        case: number of the load case.
        present: (units,) which are there.
        asked: rate, window and exposure.

    Raises:
        UserError: no such case, or nothing in the window.
    """
    cases = response.sizes["case"]
    if not 0 <= case < cases:
        remedy = f"give a number from 0 to {cases - 1}"
        raise UserError("the response has no such case", key="case", value=case, remedy=remedy)
    states = response["displacement"].isel(case=case).transpose("time", "unit", "dof").values
    given = response["time"].values
    end = given[-1] if asked.end is None else min(asked.end, given[-1])
    if end <= asked.start:
        what = "the response has ended by then"
        remedy = f"start before {given[-1]:g} s, and end after that"
        raise UserError(what, key="virtual.start", value=asked.start, remedy=remedy)
    pace = 1.0 if asked.duration is None else (end - asked.start) / asked.duration
    course = CubicSpline(given, states[:, present])
    frames = 1 + int(np.floor((asked.still + (end - asked.start) / pace) * asked.rate + 1e-9))
    time = np.arange(frames) / asked.rate

    def at(instant: Floats) -> Floats:
        return np.asarray(
            course(np.clip(asked.start + (instant - asked.still) * pace, asked.start, end))
        )

    pose = at(time)
    count = _instants(pose, asked)
    offsets = ((np.arange(count) + 0.5) / count - 0.5) * asked.sensor.exposure
    return Motion(time, pose, at(time[:, None] + offsets))


def _instants(pose: Floats, asked: Virtual) -> int:
    """How many instants make an exposure smooth."""
    step = float(np.abs(np.diff(pose[..., :2], axis=0)).max(initial=0.0))
    smear = step * asked.rate * asked.sensor.exposure / asked.camera.pixel_size
    return int(np.clip(np.ceil(smear / _FINEST), 1, _MOST))
