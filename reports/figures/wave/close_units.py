"""Measures how near the units of a structure come to one another, where contact is on distance."""

import numpy as np
import shapely
import xarray as xr
from numpy.typing import NDArray

from pipeline.posing.to_scene import contact_laws
from pipeline.problem import Problem
from reports.study import RigidUnits, deformed, from_dataset
from sim.core import Floats
from sim.structure import DistanceContact


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


def contact_places(problem: Problem, structure: RigidUnits, frame: Floats) -> Floats:
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
