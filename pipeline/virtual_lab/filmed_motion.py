"""Where the units of a response are at the instants that a video shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from pipeline.problem.sections import VirtualRecording
from pipeline.runtime import UserError
from sim.core import Floats, Mask

_FINEST = 0.3  # px between the instants of an exposure
_MOST = 9


class FilmedMotion(NamedTuple):
    """Poses of the units that are present, over the frames.

    Attributes:
        time: (frames,) of the video, at mid-exposure, s.
        pose: (frames, units, 3) at mid-exposure, mm and rad.
        instants: (frames, instants, units, 3) poses that each exposure averages.
    """

    time: Floats
    pose: Floats
    instants: Floats


class FilmClock(NamedTuple):
    """Which time of the response a video shows at which of its own.

    Attributes:
        frames: number of them.
        start, end: times of the response, s.
        still: rest at the video's start, s.
        pace: how fast the response's time goes.
    """

    frames: int
    start: float
    end: float
    still: float
    pace: float

    def shown(self, instant: Floats) -> Floats:
        """Times of the response at instants of the video, s."""
        moved = self.start + (instant - self.still) * self.pace
        return np.clip(moved, self.start, self.end)


def film_clock(given: Floats, asked: VirtualRecording) -> FilmClock:
    """The clock of a video of a response with samples at the times ``given``, s.

    Raises:
        UserError: nothing is in the window.
    """
    end = given[-1] if asked.end is None else min(asked.end, given[-1])
    if end <= asked.start:
        what = "the response has ended by then"
        remedy = f"start before {given[-1]:g} s, and end after that"
        raise UserError(what, key="virtual.start", value=asked.start, remedy=remedy)
    pace = 1.0 if asked.duration is None else (end - asked.start) / asked.duration
    frames = 1 + int(np.floor((asked.still + (end - asked.start) / pace) * asked.rate + 1e-9))
    return FilmClock(frames, asked.start, end, asked.still, pace)


def sample_motion(one: xr.Dataset, present: Mask, asked: VirtualRecording) -> FilmedMotion:
    """The motion of a structure under one load case, sampled by the frames.

    Between the samples of the response, a cubic spline; before the start, its first state.

    Args:
        one: a response at one structure and one case, or a specimen.
        present: (units,) which are there.
        asked: rate, window and exposure.

    Raises:
        UserError: nothing is in the window.
    """
    states = one["displacement"].transpose("time", "unit", "dof").values
    given = one["time"].values
    of_video = film_clock(given, asked)
    course = CubicSpline(given, states[:, present])
    time = np.arange(of_video.frames) / asked.rate

    def at(instant: Floats) -> Floats:
        return np.asarray(course(of_video.shown(instant)))

    pose = at(time)
    count = _instants(pose, asked)
    offsets = ((np.arange(count) + 0.5) / count - 0.5) * asked.sensor.exposure
    return FilmedMotion(time, pose, at(time[:, None] + offsets))


def _instants(pose: Floats, asked: VirtualRecording) -> int:
    """How many instants make an exposure smooth."""
    step = float(np.abs(np.diff(pose[..., :2], axis=0)).max(initial=0.0))
    smear = step * asked.rate * asked.sensor.exposure / asked.camera.pixel_size
    return int(np.clip(np.ceil(smear / _FINEST), 1, _MOST))
