"""Finds symmetries of a structure about its middle, and load cases that they make equal."""

from __future__ import annotations

import numpy as np

from sim.core import Floats, Ints
from sim.structure.lattice import Lattice

QUARTER_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def unit_image(
    lattice: Lattice, vertices: Floats, operation: Floats, tolerance: float
) -> Ints | None:
    """Finds the image (n_units,) of each unit under an operation; None if the structure changes.

    Args:
        lattice: the network.
        vertices: (n_vertices, 2) of the structure, mm.
        operation: (2, 2) rotation or mirror.
        tolerance: largest distance of a vertex from the image of another, mm.
    """
    middle = (lattice.site.min(axis=0) + lattice.site.max(axis=0)) / 2
    turned = (lattice.site - middle) @ operation.T + middle
    distance = np.linalg.norm(turned[:, None] - lattice.site[None], axis=2)
    image = distance.argmin(axis=1)
    if distance.min(axis=1).max() > 1e-6 * lattice.spacing:
        return None
    moved = lattice.padded((vertices - middle) @ operation.T + middle)
    there = lattice.padded(vertices)[image]
    apart = np.linalg.norm(moved[:, :, None] - there[:, None], axis=3)
    nearest = np.nanmin(np.where(np.isnan(apart), np.inf, apart), axis=2)
    nearest[np.isnan(moved[:, :, 0])] = 0.0
    return image if nearest.max() <= tolerance else None


def is_invariant(image: Ints, *sets: Ints) -> bool:
    """Checks that every set of units is mapped onto itself."""
    return all(np.array_equal(np.sort(image[units]), np.sort(units)) for units in sets)


def equal_directions(directions: Floats, kind: Ints) -> Ints:
    """Finds the first case equal to each case when a quarter turn leaves the structure alone.

    Directions (n_cases,) in rad that differ by multiples of 90 deg give turned copies of one
    response, if the drives are otherwise of one ``kind`` (n_cases,).
    """
    quarter = np.pi / 2
    reduced = np.mod(np.asarray(directions) + 1e-9, quarter)
    return np.array(
        [
            int(np.flatnonzero((np.abs(reduced - r) < 1e-8) & (kind == k))[0])
            for r, k in zip(reduced, kind, strict=True)
        ]
    )
