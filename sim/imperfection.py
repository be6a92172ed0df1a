"""Imperfect copies of a structure: vertices off their place, ligaments of another stiffness.

A copy whose units overlap cannot be made, so such a place is drawn again until none is left: the
shifts of the units concerned and of nothing else (partial resampling, Moser and Tardos 2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from sim.arrays import Floats, Ints
from sim.clearance import overlapping_pairs, polygons
from sim.geometry import void_angles
from sim.lattice import Lattice
from sim.model import Material

MOST_ROUNDS = 500
LARGEST_FACTOR = 3.0
"""Standard deviations at which the stiffness noise is cut."""


@dataclass(frozen=True)
class Copy:
    """A structure with its vertices off their place.

    Attributes:
        vertices: (n_vertices, 2) mm.
        clashes: units that overlapped, or touched at rest, in the first draw.
        redrawn: shifts that were drawn again.
        sound: whether no unit overlaps or touches another at rest.
    """

    vertices: Floats
    clashes: int
    redrawn: int
    sound: bool


def shifted(
    lattice: Lattice, vertices: Floats, largest: float, cutoff: float, random: np.random.Generator
) -> Copy:
    """A copy with every vertex moved by up to ``largest`` (mm) along x and y, evenly spread.

    The ends of a ligament move together, so it keeps its vector. Void angles stay above ``cutoff``
    (rad), where contact sets in: the copy is at rest without a load.
    """
    shifts = random.uniform(-largest, largest, (lattice.n_groups, 2))
    first = redrawn = 0
    for tries in range(MOST_ROUNDS):
        moved = vertices + shifts[lattice.group]
        clashing = clashing_units(lattice, moved, cutoff)
        first = len(clashing) if tries == 0 else first
        if len(clashing) == 0:
            return Copy(moved, first, redrawn, sound=True)
        groups = np.unique(lattice.group[np.isin(lattice.unit, clashing)])
        shifts[groups] = random.uniform(-largest, largest, (len(groups), 2))
        redrawn += len(groups)
    return Copy(moved, first, redrawn, sound=False)


def clashing_units(lattice: Lattice, vertices: Floats, cutoff: float) -> Ints:
    """Units (n,) that overlap another, cross themselves or touch another by their void angle."""
    pairs = overlapping_pairs(lattice, vertices)
    crossed = np.flatnonzero(~shapely.is_valid(polygons(lattice, vertices)))
    closed = (np.asarray(void_angles(lattice, vertices)) <= cutoff).any(axis=1)
    return np.unique(
        np.concatenate([pairs.ravel(), crossed, lattice.ligament_units[closed].ravel()])
    )


def stiffened(
    material: Material, n_ligaments: int, deviation: float, random: np.random.Generator
) -> Material:
    """The material with each stiffness of each ligament off by a normal share of ``deviation``."""
    draws = random.standard_normal((3, n_ligaments))
    factors = 1.0 + deviation * np.clip(draws, -LARGEST_FACTOR, LARGEST_FACTOR)
    axial, shear, bending = factors
    return material._replace(
        axial=material.axial * axial,
        shear=material.shear * shear,
        bending=material.bending * bending,
    )
