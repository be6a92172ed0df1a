"""Computes waves in the unit cell of a lattice: its equilibrium under a strain, its bands."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise, product
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg as la
from jax import Array

from sim.core import Floats, Ints, SimulationError
from sim.energy import (
    ContactLaw,
    LigamentLaw,
    contact_energy,
    contact_void_angles,
    ligament_energy,
    ligament_strain,
)
from sim.structure import ConcreteParameters, ContactModel, Lattice, VoidAngleContact

TOLERANCE = 1e-10
"""Of the residual of a strained cell, relative to the axial stiffness times a millimetre."""
STEPS, MAX_NEWTON = 20, 40
LONGEST_PERIOD = 6
"""That is tried of a lattice that does not repeat after the one asked for, steps."""
LARGEST_COMPRESSION = 0.5
"""Change of a ligament's length, as a share of it, from which on its law means nothing."""
LATTICE_TOLERANCE = 1e-9
"""Cosine of periods that counts as that of a right angle, and rounding of equal lengths."""


class UnitCell(NamedTuple):
    """Holds what repeats in a lattice. Contact acts on the void angles.

    Attributes:
        unit: (n_units,) ids of the cell's units in the lattice that it is from.
        joined: (n_ligaments, 2) units of the cell at the ends of each ligament.
        image: (n_ligaments, 2) lattice vector (mm) from the cell of the first end to the second's.
        arm: (n_ligaments, 2, 2) arms of both ends, mm.
        vector: (n_ligaments, 2) reference ligament vectors, mm.
        void: (n_ligaments, 2) reference void angles, rad.
        law: (n_ligaments, 3) axial, shear and bending stiffness.
        natural: (n_ligaments, 3) strains free of stress.
        contact: (n_ligaments, 3) stiffness, barrier and cutoff.
        mass: (n_units, 3) tonne, tonne, tonne mm^2.
        period: (2, 2) lattice vectors, rows, mm.
    """

    unit: Ints
    joined: Ints
    image: Floats
    arm: Floats
    vector: Floats
    void: Floats
    law: Floats
    natural: Floats
    contact: Floats
    mass: Floats
    period: Floats

    @property
    def ligaments(self) -> tuple[Floats, ...]:
        """Arms, vectors, voids and laws of the ligaments, as their energy takes them."""
        return self.arm, self.vector, self.void, self.law, self.natural, self.contact

    @property
    def n_units(self) -> int:
        """Number of units of the cell."""
        return len(self.unit)


class StrainedCell(NamedTuple):
    """Holds an equilibrium of a cell."""

    motion: Floats  # (n_units, 3) of the cell's units besides the strain
    gradient: Floats  # (2, 2) displacement gradient from one cell to the next


def cell_of(
    lattice: Lattice,
    contact: ContactModel,
    values: ConcreteParameters,
    period: tuple[int, int] = (2, 2),
) -> UnitCell:
    """Cuts the cell in the middle out of a uniform lattice.

    Args:
        lattice: wider than one period each way.
        contact: law by which its units touch, on void angles.
        values: its parameters.
        period: lattice steps after which everything repeats.

    Raises:
        ValueError: the lattice is too small for a cell whose ligaments all end at units, or it does
            not repeat so; with a period after which it does, if there is a short one.
    """
    if min(period) < 1:
        raise ValueError(f"a period of {period} lattice steps; give one or more each way")
    first, shift = _cells(lattice, period)
    number = np.full(lattice.n_units, -1)
    unit = np.flatnonzero((shift == 0).all(axis=1))
    number[unit] = np.arange(len(unit))
    vectors = np.array([_period(lattice, first, step) for step in np.diag(period)])
    of_home = _of_home(lattice, period)
    if not _repeats(lattice, of_home):
        raise ValueError(f"the lattice does not repeat after {period} steps{_hint(lattice)}")
    begin, end = lattice.ligament_units.T
    mine = np.flatnonzero(number[begin] >= 0)
    if not isinstance(contact, VoidAngleContact):
        raise ValueError("the unit cell of a lattice knows contact on void angles alone")
    limits = np.tile([contact.barrier_angle, contact.cutoff_angle], (len(mine), 1))
    return UnitCell(
        unit=unit,
        joined=number[of_home[lattice.ligament_units[mine]]],
        image=shift[end[mine]] @ vectors,
        arm=values.arm[mine],
        vector=values.vector[mine],
        void=values.void[mine],
        law=values.law[mine],
        natural=values.natural[mine],
        contact=np.column_stack([values.contact[mine], limits]),
        mass=values.mass[unit],
        period=vectors,
    )


def _period(lattice: Lattice, first: Ints, step: Ints) -> Floats:
    """Returns the lattice vector from one cell to the next along a ``step`` of the index."""
    here, there = (np.flatnonzero((lattice.index == k).all(axis=1)) for k in (first, first + step))
    if len(here) != 1 or len(there) != 1:
        raise ValueError(
            "the lattice does not reach beyond one unit cell, or its units have no indices"
        )
    return np.asarray(lattice.site[there[0]] - lattice.site[here[0]])


def _cells(lattice: Lattice, period: tuple[int, int]) -> tuple[Ints, Ints]:
    """Finds the index (2,) at which the middle cell begins, and each unit's cell (n_units, 2)."""
    first = ((lattice.index.max(axis=0) + 1) // np.array(period) - 1) // 2 * period
    return first, np.floor_divide(lattice.index - first, period)


def _of_home(lattice: Lattice, period: tuple[int, int]) -> Ints:
    """Finds the like (n_units,) of each unit in the middle cell; -1 where it has none."""
    _, shift = _cells(lattice, period)
    home = {tuple(index): unit for unit, index in enumerate(lattice.index.tolist())}
    return np.array([home.get(tuple(k), -1) for k in (lattice.index - shift * period).tolist()])


def _repeats(lattice: Lattice, of_home: Ints) -> bool:
    """Tells whether every unit is a copy of its like in the cell."""
    corners = lattice.padded(lattice.vertices - lattice.site[lattice.unit])
    near = 1e-9 * lattice.spacing
    return bool(
        (of_home >= 0).all() and np.allclose(corners, corners[of_home], atol=near, equal_nan=True)
    )


def _hint(lattice: Lattice) -> str:
    """Tells the shortest period after which a lattice repeats at least twice each way."""
    most = np.minimum((lattice.index.max(axis=0) + 1) // 2, LONGEST_PERIOD)
    tried = product(range(1, int(most[0]) + 1), range(1, int(most[1]) + 1))
    for period in sorted(tried, key=lambda steps: (steps[0] * steps[1], steps)):
        if _repeats(lattice, _of_home(lattice, period)):
            return f" of its units' index, but after {period}: give period={period}"
    return ": only a uniform one has a unit cell"


def strained(cell: UnitCell, gradient: Floats, free: Floats) -> StrainedCell:
    """Follows the equilibrium of a cell from rest as the whole lattice is strained.

    Args:
        cell: the cell.
        gradient: (2, 2) displacement gradient that is asked for.
        free: (2, 2) which of its components take the value that relieves their stress instead.

    Raises:
        SimulationError: no stable equilibrium could be followed so far.
    """
    loose = np.flatnonzero(np.ravel(free) > 0)
    state = np.zeros(3 * cell.n_units + len(loose))
    moving = np.arange(2, len(state))  # the first unit's place is where the others are seen from
    energy = jax.jit(partial(_cell_energy, cell, loose))
    derivatives = jax.jit(lambda x, f: (jax.grad(energy)(x, f), jax.hessian(energy)(x, f)))
    force = TOLERANCE * float(cell.law[:, 0].max())
    for step in range(1, STEPS + 1):
        asked = jnp.asarray(np.ravel(gradient) * step / STEPS)
        for _ in range(MAX_NEWTON):
            slope, tangent = (np.asarray(part) for part in derivatives(state, asked))
            tangent = tangent[np.ix_(moving, moving)]
            if settled := bool(np.abs(slope[moving]).max() < force):
                break
            change = np.zeros_like(state)
            change[moving] = la.solve(tangent, -slope[moving])
            state = _admissible(energy, state, change, asked)
        if not settled or la.eigvalsh(tangent, subset_by_index=[0, 0])[0] < 0:
            raise SimulationError(
                f"the unit cell has no {'stable ' if settled else ''}equilibrium beyond"
                f" {(step - 1) / STEPS:.0%} of the strain; try a smaller one",
                step=step,
            )
    found = np.array(np.ravel(gradient), dtype=float)
    found[loose] = state[3 * cell.n_units :]
    made = StrainedCell(state[: 3 * cell.n_units].reshape(-1, 3), found.reshape(2, 2))
    if (worst := _largest_compression(cell, made)) > LARGEST_COMPRESSION:
        raise SimulationError(
            f"a ligament of the unit cell would change its length by {worst:.0%}; try a smaller"
            " strain"
        )
    return made


def _largest_compression(cell: UnitCell, at: StrainedCell) -> float:
    """Finds the largest change of length of a ligament, as a share of it."""
    ends = zip(_pairs(cell, at), cell.arm, cell.vector, strict=True)
    return max(
        abs(float(ligament_strain(one, other, arm[0], arm[1], vector).stretch))
        / float(np.linalg.norm(vector))
        for (one, other), arm, vector in ends
    )


def _pairs(cell: UnitCell, at: StrainedCell) -> Floats:
    """Returns the motion (n_ligaments, 2, 3) of the units at both ends of every ligament."""
    shift = np.pad(cell.image @ at.gradient.T, ((0, 0), (0, 1)))
    first, second = cell.joined.T
    return np.stack([at.motion[first], at.motion[second] + shift], axis=1)


def _admissible(energy: Callable[[Floats, Array], Array], state: Floats, change: Floats,
                asked: Array) -> Floats:  # fmt: skip
    """Scales a change so that every void stays open."""
    for halving in range(30):
        moved = state + change / 2**halving
        if np.isfinite(energy(moved, asked)):
            return moved
    return state


def _cell_energy(cell: UnitCell, loose: Ints, state: Array, gradient: Array) -> Array:
    n = 3 * cell.n_units
    stretch = jnp.asarray(gradient).at[loose].set(state[n:]).reshape(2, 2)
    motion = state[:n].reshape(-1, 3)
    shift = jnp.pad(cell.image @ stretch.T, ((0, 0), (0, 1)))
    ends = motion[cell.joined[:, 0]], motion[cell.joined[:, 1]] + shift
    pairs = jnp.stack(ends, axis=1)
    each = jax.vmap(_pair_energy)(pairs, *(jnp.asarray(part) for part in cell.ligaments))
    return each.sum()


def _pair_energy(
    pair: Array, arm: Array, vector: Array, void: Array, law: Array, natural: Array, contact: Array
) -> Array:
    """Sums the energy of a ligament and its two voids in terms of both units' motion (2, 3)."""
    voids = contact_void_angles(void, pair[0, 2], pair[1, 2])
    closed = jax.vmap(lambda angle: contact_energy(angle, ContactLaw(*contact)))(voids)
    stiffness = LigamentLaw(*law)
    strained = ligament_energy(pair[0], pair[1], arm[0], arm[1], vector, stiffness, natural)
    return strained + closed.sum()


_pair_hessians = jax.jit(jax.vmap(jax.hessian(_pair_energy)))


def bands(cell: UnitCell, wave_vectors: Floats, at: StrainedCell | None = None) -> Floats:
    """Computes squared angular frequencies (n_waves, 3 n_units) of waves in the lattice, ascending.

    Args:
        cell: the unit cell.
        wave_vectors: (n_waves, 2) in terms of the lattice at rest, rad/mm.
        at: the equilibrium that the waves are about; by default rest.
    """
    state = StrainedCell(np.zeros((cell.n_units, 3)), np.zeros((2, 2))) if at is None else at
    pairs = _pairs(cell, state)
    blocks = _pair_hessians(pairs, *cell.ligaments)
    return np.array([_squares(cell, np.asarray(blocks), wave) for wave in wave_vectors])


def _squares(cell: UnitCell, blocks: Floats, wave: Floats) -> Floats:
    """Eigenvalues for one wave vector of pair Hessians (n_ligaments, 2, 3, 2, 3)."""
    n = cell.n_units
    dynamic = np.zeros((n, 3, n, 3), dtype=complex)
    ahead = np.exp(1j * cell.image @ wave)
    phases = np.stack([np.ones_like(ahead), ahead], axis=1)
    for (a, b), block, phase in zip(cell.joined, blocks, phases, strict=True):
        for p, row in enumerate((a, b)):
            for q, column in enumerate((a, b)):
                dynamic[row, :, column] += block[p, :, q] * np.conj(phase[p]) * phase[q]
    return np.asarray(la.eigvalsh(dynamic.reshape(3 * n, 3 * n), np.diag(cell.mass.ravel())))


def brillouin_path(cell: UnitCell, points: int) -> tuple[Floats, Ints]:
    """Spaces wave vectors (n, 2) from the zone's centre to a side, a corner, and back.

    The points are Gamma X M Gamma where the periods are at a right angle, else Gamma M K Gamma.

    Args:
        cell: the unit cell.
        points: on each of the three legs.

    Returns:
        the wave vectors in rad/mm, and the places (4,) of the named points among them.
    """
    reciprocal = np.asarray(2 * np.pi * np.linalg.inv(cell.period).T, dtype=float)
    one, corner = _side_and_corner(reciprocal)
    corners = np.array([0 * one, one / 2, corner, 0 * one])
    legs = [np.linspace(a, b, points, endpoint=False) for a, b in pairwise(corners)]
    return np.concatenate([*legs, corners[-1:]]), np.arange(4) * points


def _side_and_corner(reciprocal: Floats) -> tuple[Floats, Floats]:
    """Finds a vector (2,) across a side of the zone, and a corner (2,) of that side.

    The `reciprocal` vectors (2, 2) span the reciprocal lattice.
    """
    one, other = reciprocal
    if abs(one @ other) <= LATTICE_TOLERANCE * np.linalg.norm(one) * np.linalg.norm(other):
        return one, (one + other) / 2
    while True:  # to the shortest vectors (Gauss), across the sides of the zone
        if other @ other < one @ one * (1 - LATTICE_TOLERANCE):
            one, other = other, one
        if not (turns := np.rint(one @ other / (one @ one) * (1 - LATTICE_TOLERANCE))):
            break
        other = other - turns * one
    # as far from the origin as from two neighbours at an acute angle
    nearest = np.array([one, np.copysign(1.0, one @ other) * other])
    return one, np.linalg.solve(nearest, (nearest**2).sum(axis=1) / 2)
