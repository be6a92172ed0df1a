"""Finds contacts of a structure, by the law of contact that it runs under."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.figures.wave import close_units, closed_voids
from reports.study import RigidUnits, deformed, from_dataset
from sim.core import Floats, Mask


@dataclass(frozen=True)
class ContactMeasure:
    """Describes what the law of contact goes by at the two units that a ligament joins.

    There is contact below `begins`, and `end` is where its energy is infinite: both are in the unit
    of the values, of which one is `shown` on an axis, as is `column` the heading of a table.
    """

    title: str
    axis: str
    column: str
    shown: float
    begins: float
    end: float
    of: Callable[[Problem, xr.Dataset], Floats]


def contact_measure(problem: Problem) -> ContactMeasure:
    """Chooses the measure of contact: angles of voids, or distances of units."""
    contact = problem.contact
    if contact.law == "geometric":
        return ContactMeasure(
            title="Nearest neighbours along the top and bottom edges",
            axis="distance (mm)",
            column="edge_distance_mm",
            shown=1.0,
            begins=close_units.contact_distance(problem),
            end=0.0,
            of=close_units.joined_distances,
        )
    return ContactMeasure(
        title="Smallest void angle along the top and bottom edges",
        axis="angle (°)",
        column="edge_void_angle_rad",
        shown=180.0 / np.pi,
        begins=contact.cutoff_angle,
        end=contact.barrier_angle,
        of=closed_voids.smaller_angles,
    )


def contact_places(problem: Problem, part: xr.Dataset, sample: int) -> Floats:
    """Finds the places (n, 2) of all contacts of a structure under one load case at a time, mm."""
    structure = from_dataset(part, problem.lattice.spacing)
    frame = part["displacement"].isel(time=sample).transpose("unit", "dof").values
    if problem.contact.law == "geometric":
        return close_units.contact_places(problem, structure, frame)
    touching = closed_voids.closed(problem, part.isel(time=[sample]))[0]
    return closed_voids.middles(structure, deformed(structure, frame))[touching]


def on_edges(structure: RigidUnits) -> Mask:
    """Tells which ligaments (n_ligaments,) run along the top or the bottom row of a lattice."""
    height = structure.site[structure.ligament_unit, 1]
    ends = structure.site[:, 1].min(), structure.site[:, 1].max()
    return np.asarray(np.isin(height, ends).all(axis=1) & (np.ptp(height, axis=1) == 0.0))


def along_edges(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Measures contact (structure, case, time, ligament) along the edges."""
    whole = from_dataset(response.isel(structure=0), problem.lattice.spacing)
    n_edge, measure = int(on_edges(whole).sum()), contact_measure(problem)
    found = np.full(
        (*(response.sizes[dim] for dim in ("structure", "case", "time")), n_edge), np.nan
    )
    for k, name in enumerate(response["structure"].values):
        part = response.sel(structure=name)
        here = on_edges(from_dataset(part, problem.lattice.spacing))
        for case in range(response.sizes["case"]):
            values = measure.of(problem, part.isel(case=case))[:, here]
            found[k, case, :, : values.shape[1]] = values
    dims = ("structure", "case", "time", "ligament")
    known = ("structure", "direction", "time")
    return xr.DataArray(found, {name: response[name] for name in known}, dims)


def edge_contacts(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Counts contacts (structure, case, time) of neighbours along the top and bottom edges."""
    return (along_edges(problem, response) < contact_measure(problem).begins).sum("ligament")
