"""Describes what the units of a drive answer with: the quantity conjugate to what it prescribes."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from pipeline.problem.sections import selected_units, single_drives


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
    drive = single_drives(problem.drive)[0]
    units = list(selected_units(drive.units, problem.lattice))
    force, moment = partial(_sum, units, _along), partial(_sum, units, _about)
    moved, turned = partial(_mean, units, _along), partial(_mean, units, _about)
    if drive.kind == "force":
        return DriveResponse("displacement", "Displacement", "displacement (mm)", "mm", moved)
    if drive.kind == "torque":
        return DriveResponse(
            "turn", "Rotation", "rotation (°)", "deg", lambda each: np.degrees(1.0) * turned(each)
        )
    if drive.kind == "rotation":
        return DriveResponse("moment", "Moment", "moment (N mm)", "N mm", moment)
    return DriveResponse("reaction", "Reaction", "force (N)", "N", force)


def driven_displacement(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Finds the mean displacement in mm of the first drive's units along its direction."""
    drive = single_drives(problem.drive)[0]
    return _mean(list(selected_units(drive.units, problem.lattice)), _along, response)


_Part = Callable[[xr.DataArray, xr.Dataset], xr.DataArray]


def _sum(units: list[int], part: _Part, response: xr.Dataset) -> xr.DataArray:
    """Adds up the reactions of units."""
    return part(response["reaction_force"].sel(unit=units).sum("unit"), response)


def _mean(units: list[int], part: _Part, response: xr.Dataset) -> xr.DataArray:
    """Takes the mean motion of units."""
    return part(response["displacement"].sel(unit=units).mean("unit"), response)


def _about(vector: xr.DataArray, response: xr.Dataset) -> xr.DataArray:
    """Returns the part (structure, case, time) about the normal of the plane."""
    del response
    return vector.sel(dof="theta").transpose("structure", "case", "time")


def _along(vector: xr.DataArray, response: xr.Dataset) -> xr.DataArray:
    """Returns the part (structure, case, time) along the drive's direction."""
    angle = np.radians(response["direction"])
    along: xr.DataArray = np.cos(angle) * vector.sel(dof="ux") + np.sin(angle) * vector.sel(
        dof="uy"
    )
    return along.transpose("structure", "case", "time")
