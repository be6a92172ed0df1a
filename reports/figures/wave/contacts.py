"""Finds contacts of a structure, by the law of contact that it runs under.

Where contact is on void angles, they are closed voids; where it is on distance, close units.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
import xarray as xr
from numpy.typing import NDArray

from pipeline.posing import contact_laws
from pipeline.problem import Problem
from reports.study import RigidUnits, deformed, from_dataset
from sim.core import Floats, Ints, Mask
from sim.structure import DistanceContact


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
    if problem.contact.law != "geometric":
        return void_measure(problem)
    return ContactMeasure(
        title="Nearest neighbours along the top and bottom edges",
        axis="Distance (mm)",
        column="edge_distance_mm",
        shown=1.0,
        begins=contact_distance(problem),
        end=0.0,
        of=joined_distances,
    )


def void_measure(problem: Problem) -> ContactMeasure:
    """Describes contact by the angles of voids, as the authors have it."""
    return ContactMeasure(
        title="Smallest void angle along the top and bottom edges",
        axis="Void angle (°)",
        column="edge_void_angle_rad",
        shown=180.0 / np.pi,
        begins=problem.contact.cutoff_angle,
        end=problem.contact.barrier_angle,
        of=smaller_angles,
    )


def contact_places(problem: Problem, part: xr.Dataset, sample: int) -> Floats:
    """Finds the places (n, 2) of all contacts of a structure under one load case at a time, mm."""
    structure = from_dataset(part, problem.lattice.spacing)
    frame = part["displacement"].isel(time=sample).transpose("unit", "dof").values
    if problem.contact.law == "geometric":
        return _between_close_units(problem, structure, frame)
    touching = closed(problem, part.isel(time=[sample]))[0]
    return middles(structure, deformed(structure, frame))[touching]


def smaller_angles(problem: Problem, part: xr.Dataset) -> Floats:
    """Returns the smaller void angle beside each ligament of a structure under one load case, rad.

    Returns:
        (n_times, n_ligaments) in the order of ``from_dataset``.
    """
    structure = from_dataset(part, problem.lattice.spacing)
    turns = part["displacement"].sel(dof="theta").transpose("time", "unit").values
    first, second = structure.ligament_unit.T
    turned = turns[:, first] - turns[:, second]
    one, other = rest_angles(structure).T
    return np.asarray(np.minimum(one + turned, other - turned))


def closed(problem: Problem, part: xr.Dataset) -> Mask:
    """Tells whether a void beside each ligament (n_times, n_ligaments) is closed to the cutoff."""
    return np.asarray(smaller_angles(problem, part) < problem.contact.cutoff_angle)


def rest_angles(structure: RigidUnits) -> Floats:
    """Returns the two void angles (n_ligaments, 2) beside every ligament at rest, rad."""
    (a, b), (p, q) = structure.ligament_unit.T, structure.ligament_vertex.T
    one = _angle(_edge(structure, b, q, -1), _edge(structure, a, p, 1))
    other = _angle(_edge(structure, a, p, -1), _edge(structure, b, q, 1))
    return np.stack([one, other], axis=1)


def _edge(structure: RigidUnits, unit: Ints, vertex: Ints, way: int) -> Floats:
    """Finds vectors (n, 2) from vertices to their neighbours, counter-clockwise if ``way`` is 1."""
    corners = structure.vertices[unit]
    sides = np.isfinite(corners[..., 0]).sum(axis=1)
    each = np.arange(len(unit))
    return np.asarray(corners[each, (vertex + way) % sides] - corners[each, vertex])


def _angle(start: Floats, end: Floats) -> Floats:
    """Returns angle from one vector to another, between -90 and 270 degrees."""
    cross = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    angle = np.arctan2(cross, (start * end).sum(axis=1))
    return np.where(angle < -np.pi / 2, angle + 2 * np.pi, angle)


def middles(structure: RigidUnits, vertices: Floats) -> Floats:
    """Finds the middles (n_ligaments, 2) of ligaments between vertices (n_units, n_vertices, 2)."""
    ends = vertices[structure.ligament_unit, structure.ligament_vertex]
    return np.asarray(ends.mean(axis=1))


def contact_distance(problem: Problem) -> float:
    """Returns the distance of two units below which they are in contact, mm."""
    law = contact_laws(problem)["geometric"]
    assert isinstance(law, DistanceContact)
    return law.distance


def joined_distances(problem: Problem, part: xr.Dataset) -> Floats:
    """Measures the distance of the two units of each ligament under one load case, mm.

    Returns:
        (n_times, n_ligaments) in the order of ``from_dataset``.
    """
    structure = from_dataset(part, problem.lattice.spacing)
    motion = part["displacement"].transpose("time", "unit", "dof").values
    first, second = structure.ligament_unit.T
    outlines = (_outlines(structure, frame) for frame in motion)
    return np.array([shapely.distance(each[first], each[second]) for each in outlines])


def _between_close_units(problem: Problem, structure: RigidUnits, frame: Floats) -> Floats:
    """Finds places (n, 2) in the middle between units, joined or not, that are in contact."""
    units = _outlines(structure, frame)
    tree = shapely.STRtree(units)
    one, other = tree.query(units, "dwithin", contact_distance(problem))
    once = one < other
    lines = shapely.shortest_line(units[one[once]], units[other[once]])
    return shapely.get_coordinates(lines).reshape(-1, 2, 2).mean(axis=1)


def _outlines(structure: RigidUnits, frame: Floats) -> NDArray[np.object_]:
    """Builds polygons (n_units,) of units after displacements (n_units, 3); None where absent."""
    places = deformed(structure, frame)
    unit, vertex = np.nonzero(np.isfinite(structure.vertices[..., 0]))
    outlines = np.full(structure.n_units, None)
    present, number = np.unique(unit, return_inverse=True)
    rings = shapely.linearrings(places[unit, vertex], indices=number)
    outlines[present] = shapely.polygons(rings)
    return outlines
