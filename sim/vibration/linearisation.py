"""Linearises a structure about a state: small vibrations, resonances, transmission."""

from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from sim.collision import raise_new_pairs
from sim.core import Floats, Ints, NewContactPairs
from sim.energy import Topology, kinematics_of, locate, system_of, tangent
from sim.linalg import clear, matrix
from sim.structure import ConcreteParameters

Complexes: TypeAlias = NDArray[np.complex128]

SHIFT = 1.0
"""rad/s: keeps the shifted stiffness of a structure that floats freely from being singular."""


class Linear(NamedTuple):
    """Holds M u'' + C u' + K u = -K_held u_held for small motions u of free dofs about a state."""

    stiffness: sp.csc_array  # (n_free, n_free) K, tangent of the energy
    coupling: sp.csc_array  # (n_free, n_held) K_held
    mass: Floats  # (n_free,) diagonal of M
    damping: Floats  # (n_free,) diagonal of C
    free: Ints  # ids (3 unit + dof)
    held: Ints  # ids (3 unit + dof)

    @property
    def n_dofs(self) -> int:
        """Number of all dofs."""
        return len(self.free) + len(self.held)


class Modes(NamedTuple):
    """Holds undamped vibrations in ascending order."""

    square: Floats  # (count,) squared angular frequency, rad^2/s^2; negative: unstable
    shape: Floats  # (count, n_units, 3) of unit modal mass

    @property
    def frequency(self) -> Floats:
        """(count,) Hz; negative rates of growth (per s, over 2 pi) where the state is unstable."""
        return np.asarray(np.sign(self.square) * np.sqrt(np.abs(self.square)) / (2 * np.pi))


class _SubmatrixPattern(NamedTuple):
    """Holds where the entries of a part of a tangent come from, as long as no others appear."""

    rows: Ints
    columns: Ints
    occupied: Ints  # places among the bands that are not zero
    source: Ints  # (n_entries,) place of each among the bands
    entry_row: Ints  # (n_entries,) row of each
    first: Ints  # (n_columns + 1,) first entry of each column

    def matches(self, rows: Ints, columns: Ints, occupied: Ints) -> bool:
        """Tests whether the part is the same, and its pattern."""
        return (
            np.array_equal(self.rows, rows)
            and np.array_equal(self.columns, columns)
            and np.array_equal(self.occupied, occupied)
        )


class FullTangent:
    """Evaluates a structure's tangent among all dofs, held ones included, state by state."""

    def __init__(self, topology: Topology, values: ConcreteParameters) -> None:
        none = np.zeros(0, dtype=np.int64)
        full = replace(topology.unloaded, held=none, storages=("band",))
        self._place, pattern = full.numbering
        self._system = system_of(full, values)
        self._matrix, self._kinematics = matrix(pattern), kinematics_of(self._system)
        self._pattern: _SubmatrixPattern | None = None

    def submatrix(self, rows: Ints, columns: Ints, state: Floats) -> sp.csc_array:
        """Assembles the part (n_rows, n_columns) of some dofs at a state (n_dofs,).

        Raises:
            NewContactPairs: units are near whose coupling the tangent has no room for.
        """
        made = self._matrix
        clear(made)
        locate(state, self._system, self._kinematics)
        tangent(state, self._system, self._kinematics, made)
        raise_new_pairs(self._system.contacts)
        occupied = np.flatnonzero(made.values)
        if self._pattern is None or not self._pattern.matches(rows, columns, occupied):
            self._pattern = self._find_pattern(rows, columns, occupied)
        pattern = self._pattern
        shape = len(rows), len(columns)
        return sp.csc_array(
            (made.values[pattern.source], pattern.entry_row, pattern.first), shape=shape
        )

    def _find_pattern(self, rows: Ints, columns: Ints, occupied: Ints) -> _SubmatrixPattern:
        """Finds where the entries of a part lie among the bands."""
        n, width = self._system.pattern.size
        column, below = np.divmod(occupied, width + 1)
        row, off = column + below, below > 0
        full = sp.csr_array(
            (
                np.append(occupied, occupied[off]) + 1,
                (np.append(row, column[off]), np.append(column, row[off])),
            ),
            shape=(n, n),
        )
        found = sp.csc_array(full[self._place[rows]][:, self._place[columns]])
        found.sort_indices()
        return _SubmatrixPattern(
            rows, columns, occupied, found.data - 1, found.indices, found.indptr
        )


def linearised(
    topology: Topology, values: ConcreteParameters, motion: Floats | None = None
) -> Linear:
    """Linearises a structure about a state ``motion`` (n_units, 3); by default about rest."""
    try:
        return _linearised(topology.unloaded, values, motion)
    except NewContactPairs as met:
        return linearised(topology.coupling(met.pairs), values, motion)


def _linearised(topology: Topology, values: ConcreteParameters, motion: Floats | None) -> Linear:
    full = FullTangent(topology, values)
    state = np.zeros(topology.n_dofs) if motion is None else np.array(motion, dtype=float).ravel()
    free = np.setdiff1d(np.arange(topology.n_dofs), topology.held)
    return Linear(
        stiffness=full.submatrix(free, free, state),
        coupling=full.submatrix(free, topology.held, state),
        mass=np.asarray(values.mass).ravel()[free],
        damping=np.asarray(values.damping).ravel()[free],
        free=free,
        held=topology.held,
    )


def modes(of: Linear, count: int, near: float = 0.0) -> Modes:
    """Computes the ``count`` modes nearest to a frequency (rad/s), by shift-invert Lanczos.

    Raises:
        ValueError: the structure has not so many modes.
    """
    size = len(of.free)
    if not 0 < count < size:
        raise ValueError(f"{count} modes of a structure with {size} degrees of freedom")
    start = np.random.default_rng(0).normal(size=size)
    shift = near**2 - SHIFT**2
    squares, shapes = spla.eigsh(
        of.stiffness, k=count, M=sp.diags_array(of.mass).tocsc(), sigma=shift, v0=start
    )
    order = np.argsort(squares)
    shape = np.zeros((count, of.n_dofs))
    shape[:, of.free] = (shapes * _signs(shapes)).T[order]
    return Modes(squares[order], shape.reshape(count, -1, 3))


def _signs(shapes: Floats) -> Floats:
    """Makes the largest entry of every mode positive: the sign of a mode is arbitrary."""
    largest = np.abs(shapes).argmax(axis=0)
    return np.asarray(np.sign(shapes[largest, np.arange(shapes.shape[1])]))


def transmission(of: Linear, drives: Floats, frequencies: Floats) -> Complexes:
    """Computes the steady motion (n_frequencies, n_cases, n_units, 3) under harmonic drives.

    Args:
        of: the structure.
        drives: (n_held, n_cases) amplitudes of the held dofs.
        frequencies: (n_frequencies,) angular, rad/s.

    Returns:
        complex amplitudes: the real part of their product with exp(i w t) is the motion.
    """
    right = -(of.coupling @ drives).astype(complex)
    out = np.zeros((len(frequencies), drives.shape[1], of.n_dofs), dtype=complex)
    out[..., of.held] = drives.T
    for steady, w in zip(out, frequencies, strict=True):
        dynamic = of.stiffness + sp.diags_array(1j * w * of.damping - w**2 * of.mass)
        steady[:, of.free] = spla.splu(sp.csc_array(dynamic)).solve(right).T
    return out.reshape(*out.shape[:2], -1, 3)
