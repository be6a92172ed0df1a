"""Finds the directions of straight drives: as given, or those of a measured motion."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from pipeline.problem.sections import SingleDrive, TimeSeriesDrive
from sim.core import Floats

_BACK = 0.5
"""Share of its largest displacement that a swinging motion goes to the other side."""


def drive_directions(
    drive: SingleDrive, response: xr.Dataset, units: Sequence[int]
) -> tuple[float, ...]:
    """Returns the directions of a drive of `units` in its load cases, rad.

    A measured motion has one for all cases, along its largest displacement: if it swings, of the
    two the one to the right; none if it only turns.
    """
    if not isinstance(drive, TimeSeriesDrive):
        return tuple(getattr(drive, "directions", ()))
    course = _course(response, units)
    x, y = course[np.hypot(*course.T).argmax()]
    if np.hypot(x, y) == 0.0:
        return ()
    angle = float(np.arctan2(y, x))
    leftward = not -np.pi / 2 < angle <= np.pi / 2
    return (angle - np.copysign(np.pi, angle) if leftward and _swings(course) else angle,)


def swings(drive: SingleDrive, response: xr.Dataset, units: Sequence[int]) -> bool:
    """Tests if a drive is a measured motion that goes to both sides of where it starts."""
    return isinstance(drive, TimeSeriesDrive) and _swings(_course(response, units))


def _course(response: xr.Dataset, units: Sequence[int]) -> Floats:
    """Returns the displacement (n_times, 2) of the first unit of a drive, mm."""
    moved = response["displacement"].isel(structure=0, case=0, unit=units[0])
    return np.asarray(moved.sel(dof=["ux", "uy"]).transpose("time", "dof").values)


def _swings(course: Floats) -> bool:
    along = course @ course[np.hypot(*course.T).argmax()]
    return bool(along.min() < -_BACK * along.max())
