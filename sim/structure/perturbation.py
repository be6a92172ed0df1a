"""Imperfect copies of a structure: vertices and units off their place, ligaments off in stiffness.

A copy whose units overlap cannot be made, so such a place is drawn again until none is left: the
shifts of the units concerned and of nothing else (partial resampling, Moser and Tardos 2010).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely

from sim.core import Floats, Ints
from sim.structure.contact_laws import ContactModel, VoidAngleContact
from sim.structure.gaps import overlapping_pairs, polygons
from sim.structure.geometry import void_angles
from sim.structure.lattice import Lattice
from sim.structure.material import Material

MOST_ROUNDS = 500
LARGEST_FACTOR = 3.0
"""Standard deviations at which the stiffness noise is cut."""


@dataclass(frozen=True)
class PerturbedStructure:
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
    lattice: Lattice,
    vertices: Floats,
    largest: float,
    contact: ContactModel,
    random: np.random.Generator,
) -> PerturbedStructure:
    """A copy with every vertex moved by up to ``largest`` (mm) along x and y, evenly spread.

    The ends of a ligament move together, so it keeps its vector. Void angles stay above the cutoff
    of contact on them: the copy is at rest without a load.
    """
    shifts = random.uniform(-largest, largest, (lattice.n_groups, 2))
    first = redrawn = 0
    for tries in range(MOST_ROUNDS):
        moved = vertices + shifts[lattice.group]
        clashing = clashing_units(lattice, moved, contact)
        first = len(clashing) if tries == 0 else first
        if len(clashing) == 0:
            return PerturbedStructure(moved, first, redrawn, sound=True)
        groups = np.unique(lattice.group[np.isin(lattice.unit, clashing)])
        shifts[groups] = random.uniform(-largest, largest, (len(groups), 2))
        redrawn += len(groups)
    return PerturbedStructure(moved, first, redrawn, sound=False)


def assembled(
    lattice: Lattice,
    copy: PerturbedStructure,
    spread: tuple[float, float],
    contact: ContactModel,
    random: np.random.Generator,
) -> PerturbedStructure:
    """The copy once its units are joined, each off its place.

    The ligaments are at rest there: they are as long and as inclined as the units leave them. Units
    that would overlap or touch are put elsewhere.

    Args:
        lattice: of the copy.
        copy: its units as they were cut.
        spread: standard deviations of the units' shifts along x and along y, mm, and of their
            rotations, rad.
        contact: law of contact.
        random: draws the places.
    """
    deviation = np.array([spread[0], *spread])
    pose = deviation * random.standard_normal((lattice.n_units, 3))
    for _ in range(MOST_ROUNDS):
        placed = _placed(lattice, copy.vertices, pose)
        clashing = clashing_units(lattice, placed, contact)
        if len(clashing) == 0:
            return replace(copy, vertices=placed)
        pose[clashing] = deviation * random.standard_normal((len(clashing), 3))
    return replace(copy, vertices=placed, sound=False)


def _placed(lattice: Lattice, vertices: Floats, pose: Floats) -> Floats:
    """Vertices (n_vertices, 2) of units that are moved by a pose (n_units, 3) each, mm and rad."""
    middle = np.add.reduceat(vertices, lattice.first_vertex[:-1])
    middle /= np.diff(lattice.first_vertex)[:, None]
    arm = vertices - middle[lattice.unit]
    cos, sin = (of(pose[lattice.unit, 2, None]) for of in (np.cos, np.sin))
    across = np.column_stack([-arm[:, 1], arm[:, 0]])
    return np.asarray((middle + pose[:, :2])[lattice.unit] + cos * arm + sin * across)


def clashing_units(lattice: Lattice, vertices: Floats, contact: ContactModel) -> Ints:
    """Units (n,) that overlap another, cross themselves or touch another by their void angle."""
    pairs = overlapping_pairs(lattice, vertices)
    crossed = np.flatnonzero(~shapely.is_valid(polygons(lattice, vertices)))
    cutoff = contact.cutoff if isinstance(contact, VoidAngleContact) else -np.inf
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
