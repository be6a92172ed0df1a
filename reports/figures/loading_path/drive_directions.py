"""Finds the directions of straight drives: as given, or those of a measured motion."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from pipeline.posing import main_direction, swings_back
from pipeline.problem.sections import SingleDrive, TimeSeriesDrive
from sim.core import Floats


def drive_directions(
    drive: SingleDrive, response: xr.Dataset, units: Sequence[int]
) -> tuple[float, ...]:
    """Returns the directions of a drive of `units` in its load cases, rad.

    A measured motion has one for all cases, along its largest displacement: if it swings, of the
    two the one to the right; none if it only turns.
    """
    if not isinstance(drive, TimeSeriesDrive):
        return tuple(getattr(drive, "directions", ()))
    found = main_direction(_history(response, units))
    return () if found is None else (found,)


def swings(drive: SingleDrive, response: xr.Dataset, units: Sequence[int]) -> bool:
    """Tests if a drive is a measured motion that goes to both sides of where it starts."""
    return isinstance(drive, TimeSeriesDrive) and swings_back(_history(response, units))


def _history(response: xr.Dataset, units: Sequence[int]) -> Floats:
    """Returns the displacement (n_times, 2) of the first unit of a drive, mm."""
    moved = response["displacement"].isel(structure=0, case=0, unit=units[0])
    return np.asarray(moved.sel(dof=["ux", "uy"]).transpose("time", "dof").values)
