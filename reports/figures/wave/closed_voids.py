"""Tells which voids of a structure are closed to contact, and when."""

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.study import RigidUnits, from_dataset
from sim.core import Floats, Ints, Mask


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
