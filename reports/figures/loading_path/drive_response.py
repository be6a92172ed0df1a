"""Describes what the units of a drive answer with: the quantity conjugate to what it prescribes."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from pipeline.problem.sections import TimeSeriesDrive, selected_units, single_drives
from reports.figures.loading_path.drive_directions import drive_directions


@dataclass(frozen=True)
class DriveResponse:
    """Describes a number of the units of a problem's first drive, which is the one on axes.

    `of` maps a response to (structure, case, time) in `unit`; `key` names the words of panel and
    facts, `title` stands above a panel, `axis` on its axis.
    """

    key: str
    title: str
    axis: str
    unit: str
    of: Callable[[xr.Dataset], xr.DataArray]

    @property
    def held(self) -> bool:
        """Tells a force or a moment, which the drive exerts to prescribe a motion."""
        return self.key in ("reaction", "moment")


def drive_response(problem: Problem) -> DriveResponse:
    """Returns how far a load moves its units, or what force or moment a motion asks for."""
    kind = single_drives(problem.drive)[0].kind
    if kind == "force":
        moved = partial(driven_displacement, problem)
        return DriveResponse("displacement", "Displacement", "Displacement (mm)", "mm", moved)
    if kind == "torque":
        return DriveResponse("turn", "Rotation", "Rotation (°)", "deg", partial(_turn, problem))
    if kind == "rotation":
        return DriveResponse("moment", "Moment", "Moment (N mm)", "N mm", partial(_moment, problem))
    return DriveResponse("reaction", "Reaction", "Force (N)", "N", partial(_force, problem))


def driven_displacement(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Finds the mean displacement in mm of the first drive's units along its direction."""
    return _along(problem, _driven(problem, response["displacement"]).mean("unit"), response)


def _turn(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Finds the mean rotation of the units, degrees."""
    turn = _driven(problem, response["displacement"]).sel(dof="theta").mean("unit")
    return turn * (180.0 / np.pi)


def _moment(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Finds the moment on all of the units together, N mm."""
    return _driven(problem, response["reaction_force"]).sel(dof="theta").sum("unit")


def _force(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Finds the force along the drive on all of the units together, N."""
    return _along(problem, _driven(problem, response["reaction_force"]).sum("unit"), response)


def _driven(problem: Problem, values: xr.DataArray) -> xr.DataArray:
    """Selects values of the first drive's units."""
    return values.sel(unit=_units(problem))


def _units(problem: Problem) -> list[int]:
    return list(selected_units(single_drives(problem.drive)[0].units, problem.lattice))


def _along(problem: Problem, vector: xr.DataArray, response: xr.Dataset) -> xr.DataArray:
    """Returns the part (structure, case, time) along the first drive's direction."""
    direction, drive = response["direction"], single_drives(problem.drive)[0]
    if isinstance(drive, TimeSeriesDrive):  # one for all structures and cases
        found = drive_directions(drive, response, _units(problem))
        direction = xr.full_like(direction, np.degrees(next(iter(found), 0.0)))
    angle = np.radians(direction)
    along: xr.DataArray = np.cos(angle) * vector.sel(dof="ux") + np.sin(angle) * vector.sel(
        dof="uy"
    )
    return along.transpose("structure", "case", "time")
