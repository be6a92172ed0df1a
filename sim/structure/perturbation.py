"""Perturbs copies of a structure: vertices and units off their place, constants off their value.

A copy whose units overlap cannot be made, so such a place is drawn again until none is left: the
shifts of the units concerned and of nothing else (partial resampling, Moser and Tardos 2010).
"""

from collections.abc import Sequence
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
"""Standard deviations at which the noise of constants is cut."""


@dataclass(frozen=True)
class Perturbation:
    """Sizes of the deviations of a copy; None draws nothing."""

    geometry: float | None = None  # largest shift of a vertex along x and y, evenly spread, mm
    ligaments: float | None = None  # deviation of each ligament's stiffnesses, as a share
    stiffness: float | None = None  # of each of the three stiffnesses, of all ligaments
    units: float | None = None  # the same of every unit's damping
    damping: float | None = None  # the same of the damping of all units together
    # standard deviations of the units' shifts along x and along y, mm, and of their rotations, rad
    assembly: tuple[float, float] | None = None


@dataclass(frozen=True)
class PerturbedStructure:
    """Describes a structure with its vertices off their place and its constants off their value.

    Where the units were assembled off their place, ligaments join them as they lie: a scene of it
    needs ``dataclasses.replace(lattice, vertices=vertices)``. Otherwise they keep their vectors.
    """

    vertices: Floats  # (n_vertices, 2) mm
    material: Material  # its constants, where they differ by ligament or unit as arrays
    clashes: int = 0  # units that overlapped, or touched at rest, in the first draw
    redrawn: int = 0  # shifts that were drawn again
    sound: bool = True  # whether no unit overlaps or touches another at rest


@dataclass(frozen=True, eq=False)
class Copies:
    """Holds the deviations of copies of whatever structure; they may overlap."""

    shifts: Floats  # (n_copies, n_groups, 2) of the vertices, mm
    stiffness: Floats  # (n_copies, 3, n_ligaments) factors of axial, shear, bending stiffness

    def __len__(self) -> int:
        """Counts the copies."""
        return len(self.shifts)


def draw_copies(lattice: Lattice, sizes: Perturbation, count: int, seed: int) -> Copies:
    """Draws vertices and stiffnesses of copies that an optimisation keeps while designs change."""
    random, reach = np.random.default_rng(seed), sizes.geometry or 0.0
    shifts = random.uniform(-reach, reach, (count, lattice.n_groups, 2))
    own = _factors((count, 3, lattice.n_ligaments), sizes.ligaments, random)
    return Copies(shifts, own * _factors((count, 3, 1), sizes.stiffness, random))


def perturbed(
    lattice: Lattice,
    vertices: Floats,
    material: Material,
    sizes: Perturbation,
    contact: ContactModel,
    seed: Sequence[int],
) -> PerturbedStructure:
    """Draws a copy of a structure; equal seeds give equal copies, whatever else is drawn.

    `vertices` (n_vertices, 2) are the design's, mm. Void angles stay above the cutoff angle of a
    contact law on them: the copy is at rest without a load.
    """
    random = np.random.default_rng(seed)
    copy = PerturbedStructure(vertices, material)
    if sizes.geometry is not None:
        copy = _shifted(lattice, copy, sizes.geometry, contact, random)
    copy = replace(copy, material=_varied(lattice, material, sizes, random))
    if sizes.assembly is not None:
        joints = np.random.default_rng((*seed, 1))
        copy = _assembled(lattice, copy, sizes.assembly, contact, joints)
    return copy


def _varied(
    lattice: Lattice, material: Material, sizes: Perturbation, random: np.random.Generator
) -> Material:
    own = _factors((3, lattice.n_ligaments), sizes.ligaments, random)
    common = _factors((3, 1), sizes.stiffness, random)
    damping = _factors((lattice.n_units,), sizes.units, random)
    damping = damping * _factors((1,), sizes.damping, random)
    return material.scaled(own * common)._replace(
        damping_translation=material.damping_translation * damping,
        damping_rotation=material.damping_rotation * damping,
    )


def _factors(
    shape: tuple[int, ...], deviation: float | None, random: np.random.Generator
) -> Floats:
    """Draws normal factors about one, none below a tenth; ones where there is no deviation."""
    if deviation is None:
        return np.ones(shape)
    draws = np.clip(random.standard_normal(shape), -LARGEST_FACTOR, LARGEST_FACTOR)
    return np.maximum(1.0 + deviation * draws, 0.1)


def _shifted(
    lattice: Lattice,
    copy: PerturbedStructure,
    largest: float,
    contact: ContactModel,
    random: np.random.Generator,
) -> PerturbedStructure:
    """Moves every vertex by up to ``largest`` (mm) along x and y, evenly spread.

    The ends of a ligament move together, so it keeps its vector.
    """
    shifts = random.uniform(-largest, largest, (lattice.n_groups, 2))
    first = redrawn = 0
    for tries in range(MOST_ROUNDS):
        moved = copy.vertices + shifts[lattice.group]
        clashing = clashing_units(lattice, moved, contact)
        first = len(clashing) if tries == 0 else first
        if len(clashing) == 0:
            return replace(copy, vertices=moved, clashes=first, redrawn=redrawn)
        groups = np.unique(lattice.group[np.isin(lattice.unit, clashing)])
        shifts[groups] = random.uniform(-largest, largest, (len(groups), 2))
        redrawn += len(groups)
    return replace(copy, vertices=moved, clashes=first, redrawn=redrawn, sound=False)


def _assembled(
    lattice: Lattice,
    copy: PerturbedStructure,
    spread: tuple[float, float],
    contact: ContactModel,
    random: np.random.Generator,
) -> PerturbedStructure:
    """Joins the units of a copy, each off its place by ``spread`` (mm, rad).

    The ligaments are at rest there: they are as long and as inclined as the units leave them. Units
    that would overlap or touch are put elsewhere.
    """
    deviation = np.array([spread[0], *spread])
    pose = deviation * random.standard_normal((lattice.n_units, 3))
    for _ in range(MOST_ROUNDS):
        placed = _move_units(lattice, copy.vertices, pose)
        clashing = clashing_units(lattice, placed, contact)
        if len(clashing) == 0:
            return replace(copy, vertices=placed)
        pose[clashing] = deviation * random.standard_normal((len(clashing), 3))
    return replace(copy, vertices=placed, sound=False)


def _move_units(lattice: Lattice, vertices: Floats, pose: Floats) -> Floats:
    """Moves units by a pose (n_units, 3) each, mm and rad; returns their vertices."""
    middle = np.add.reduceat(vertices, lattice.first_vertex[:-1])
    middle /= np.diff(lattice.first_vertex)[:, None]
    arm = vertices - middle[lattice.unit]
    cos, sin = (of(pose[lattice.unit, 2, None]) for of in (np.cos, np.sin))
    across = np.column_stack([-arm[:, 1], arm[:, 0]])
    return np.asarray((middle + pose[:, :2])[lattice.unit] + cos * arm + sin * across)


def clashing_units(lattice: Lattice, vertices: Floats, contact: ContactModel) -> Ints:
    """Finds the units (n,) that overlap or touch (by a void angle) another, or cross themselves."""
    pairs = overlapping_pairs(lattice, vertices)
    crossed = np.flatnonzero(~shapely.is_valid(polygons(lattice, vertices)))
    cutoff = contact.cutoff_angle if isinstance(contact, VoidAngleContact) else -np.inf
    closed = (np.asarray(void_angles(lattice, vertices)) <= cutoff).any(axis=1)
    return np.unique(
        np.concatenate([pairs.ravel(), crossed, lattice.ligament_units[closed].ravel()])
    )
