"""Interpolates the study's own response at the times or loads of the measured frames."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.comparison import alignment
from pipeline.comparison.alignment import Lag, SampledMotion
from pipeline.runtime import UserError
from sim.core import Floats, Ints, Mask

BOTH: Mask = np.ones(2, dtype=bool)
"""A drive that displaces its units along x and y."""
_LOAD_SHARE = 0.01  # of the greatest load: none yet


class ComparisonAxis(NamedTuple):
    """Holds the time or load that both sides have in common."""

    time: Floats  # (frames,) of the response, s; NaN where it has none
    branch: NDArray[np.int8]  # (frames,) which way the load goes
    lag: Lag | None  # of the drive; None for load, which has no time
    turn: float  # direction of the measured less that of the nominal drive, rad

    @property
    def at_rest(self) -> Mask:
        """Marks the first frames (frames,), before the drive begins."""
        begun = self.time > (_LOAD_SHARE * np.nanmax(self.time) if self.lag is None else 0.0)
        return np.isfinite(self.time) & ~np.logical_or.accumulate(begun)

    def select(self, kept: Ints) -> "ComparisonAxis":
        """Selects frames (n,) by number."""
        return self._replace(time=self.time[kept], branch=self.branch[kept])


class NominalSide(NamedTuple):
    """Holds the response at the frames."""

    displacement: Floats  # (frames, units, 3) mm and rad, NaN where there is none
    drive: Floats  # (frames, 2) of the driven units, mm
    force: Floats  # (frames,) of the drive along its direction, N


def drive_direction(response: xr.Dataset) -> Floats:
    """Computes the unit vector (2,) of the drive of a response of one case."""
    angle = np.deg2rad(float(response["direction"]))
    return np.array([np.cos(angle), np.sin(angle)])


def find_axis(
    time: Floats, drive: Floats, response: xr.Dataset, *, static: bool, moved: Mask = BOTH
) -> ComparisonAxis:
    """Places the measured frames on the axis of a response of one structure and case.

    Args:
        time: (frames,) on the track's clock, s.
        drive: (frames, 2) measured displacement of the driven units, mm.
        response: the nominal one.
        static: whether it is a path of equilibria.
        moved: (2,) whether the drive displaces its units along x and y, or lets them slide there.

    Raises:
        UserError: the drive cannot be aligned, or is a force, a moment or a rotation.
    """
    nominal = SampledMotion(response["time"].values, response["drive_displacement"].values)
    if not nominal.value.any():
        what = "the drive displaces no units, along which frames could be placed"
        remedy = "drive the problem by the displacement that was filmed, or remove the recording"
        raise UserError(what, key="drive.kind", remedy=remedy)
    held = np.where(moved, drive, 0.0)  # what slides tells of the specimen, not of the drive
    if not static:
        lag = alignment.find_lag(SampledMotion(time, held), nominal)
        turn = _drive_turn(held, nominal.at(time - lag.value), moved)
        still = np.full(len(time), alignment.MOTION, dtype=np.int8)
        shown = np.where(time - lag.value <= nominal.time[-1], time - lag.value, np.nan)
        return ComparisonAxis(shown, still, lag, turn)
    way = drive_direction(response)
    pushed = SampledMotion(nominal.time, (nominal.value @ way)[:, None])
    shown = alignment.find_load_time(held @ way, pushed)
    turn = _drive_turn(held, nominal.at(shown), moved)
    return ComparisonAxis(shown, alignment.find_branches(held @ way), None, turn)


def _drive_turn(held: Floats, nominal: Floats, moved: Mask) -> float:
    """Computes by how much the drive was turned, rad; NaN where it does not hold both ways."""
    return alignment.drive_turn(held, nominal) if moved.all() else np.nan


def interpolate_response(response: xr.Dataset, time: Floats) -> NominalSide:
    """Interpolates a response of one structure and case at its own times, NaN where these are.

    Before its start it rests; between its samples runs a cubic spline.
    """
    samples = response["time"].values
    known = np.isfinite(time)
    at = np.clip(time[known], samples[0], samples[-1])

    def interpolate(values: Floats) -> Floats:
        out = np.full((len(time), *values.shape[1:]), np.nan)
        out[known] = CubicSpline(samples, values)(at)
        return out

    motion = response["displacement"].transpose("time", "unit", "dof").values
    present = np.isfinite(motion[0, :, 0])
    displacement = np.full((len(time), *motion.shape[1:]), np.nan)
    displacement[:, present] = interpolate(motion[:, present])
    drive = interpolate(response["drive_displacement"].transpose("time", "xy").values)
    force = interpolate(
        response["drive_force"].transpose("time", "xy").values @ drive_direction(response)
    )
    return NominalSide(displacement, drive, force)
