"""Which voids of a structure are closed to contact, and when."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.problem import Problem
from reports.structure import Integers, Structure, from_dataset

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def closed(problem: Problem, part: xr.Dataset) -> Mask:
    """Whether a void beside each ligament of a structure is closed to the cutoff.

    Args:
        problem: the problem.
        part: one structure of a response, one load case.

    Returns:
        (n_times, n_ligaments) in the order of ``from_dataset``.
    """
    structure = from_dataset(part, problem.lattice.spacing)
    turns = part["displacement"].sel(dof="theta").transpose("time", "unit").values
    first, second = structure.ligament_unit.T
    turned = turns[:, first] - turns[:, second]
    one, other = rest_angles(structure).T
    return np.asarray(np.minimum(one + turned, other - turned) < problem.contact.cutoff_angle)


def rest_angles(structure: Structure) -> Array:
    """The two void angles (n_ligaments, 2) beside every ligament at rest, rad."""
    (a, b), (p, q) = structure.ligament_unit.T, structure.ligament_vertex.T
    one = _angle(_edge(structure, b, q, -1), _edge(structure, a, p, 1))
    other = _angle(_edge(structure, a, p, -1), _edge(structure, b, q, 1))
    return np.stack([one, other], axis=1)


def _edge(structure: Structure, unit: Integers, vertex: Integers, way: int) -> Array:
    """Vectors (n, 2) from vertices to their neighbours, counter-clockwise if ``way`` is 1."""
    corners = structure.vertices[unit]
    sides = np.isfinite(corners[..., 0]).sum(axis=1)
    each = np.arange(len(unit))
    return np.asarray(corners[each, (vertex + way) % sides] - corners[each, vertex])


def _angle(start: Array, end: Array) -> Array:
    """Angle from one vector to another, between -90 and 270 degrees."""
    cross = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    angle = np.arctan2(cross, (start * end).sum(axis=1))
    return np.where(angle < -np.pi / 2, angle + 2 * np.pi, angle)


def on_edges(structure: Structure) -> Mask:
    """Which ligaments (n_ligaments,) run along the top or the bottom edge."""
    height = structure.site[structure.ligament_unit, 1]
    ends = structure.site[:, 1].min(), structure.site[:, 1].max()
    return np.asarray(np.isin(height, ends).all(axis=1) & (np.ptp(height, axis=1) == 0.0))


def middles(structure: Structure, vertices: Array) -> Array:
    """Middles (n_ligaments, 2) of the ligaments between vertices (n_units, n_vertices, 2), mm."""
    ends = vertices[structure.ligament_unit, structure.ligament_vertex]
    return np.asarray(ends.mean(axis=1))


def edge_contacts(problem: Problem, response: xr.Dataset) -> xr.DataArray:
    """Number (structure, case, time) of closed voids along the top and bottom edges."""
    counts = [
        [
            closed(problem, part.isel(case=case))[
                :, on_edges(from_dataset(part, problem.lattice.spacing))
            ].sum(axis=1)
            for case in range(response.sizes["case"])
        ]
        for part in (response.sel(structure=name) for name in response["structure"].values)
    ]
    return xr.DataArray(
        np.array(counts, dtype=float),
        dims=("structure", "case", "time"),
        coords={"structure": response["structure"], "time": response["time"]},
    )
