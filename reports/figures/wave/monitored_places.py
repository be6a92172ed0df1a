"""Tells how a wave goes on in each structure: at some places, and against the intact one."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from pipeline.posing import relative_errors
from pipeline.problem import Problem
from reports.figures.loading_path import interest, scales
from reports.study import RigidUnits, middle_of_top_edge, on_lattice, unit_at

Mark = str | tuple[int, int, int]

MARKS: tuple[Mark, ...] = ("o", "D", (4, 1, 0))
"""Of the places: circle, diamond, four-pointed star."""


@dataclass(frozen=True)
class MonitoredUnit:
    """Describes a unit whose motion is shown over time, with its mark."""

    unit: int
    mark: Mark
    name: str


def places(problem: Problem, response: xr.Dataset) -> list[MonitoredUnit]:
    """Returns the places that the problem names; the middle of the top edge where it names none."""
    structure = first_structure(problem, response)
    units = [unit_at(structure, np.array(point)) for point in problem.report.places]
    found = []
    for mark, unit in zip(MARKS, units or [middle_of_top_edge(structure)], strict=False):
        i, j = (int(response[name][unit]) for name in ("i", "j"))
        found.append(MonitoredUnit(unit, mark, f"unit ({i}, {j})"))
    return found


def first_structure(problem: Problem, response: xr.Dataset) -> RigidUnits:
    """Returns the intact structure."""
    return on_lattice(response.sel(structure="intact"), problem.lattice)


def relative_error(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Finds the relative L2 error (structure, case) of the surroundings over the whole history."""
    dims = ("structure", "case", "time", "unit", "dof")
    moved = interest(response).transpose(*dims) / np.array(scales(problem))
    intact, along = moved.sel(structure="intact").values, response["time"].values
    found = [relative_errors(each, intact, along) for each in moved.values]
    return xr.DataArray(found, {"structure": moved["structure"]}, dims[:2])
