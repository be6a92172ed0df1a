"""Evaluates the requirements on a design as one vector function with a sparse Jacobian.

Values and local derivatives are evaluated together, place by place, and scattered into the Jacobian
through a map computed once.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp
from jax import Array

from sim.constraints.manufacturability import (
    ConstraintKind,
    Limits,
    Margin,
    kinds,
    vertices_of,
    worst,
)
from sim.constraints.slot_walls import points
from sim.core import Floats, Ints
from sim.structure import DesignSpace


@dataclass(frozen=True)
class ConstraintVector:
    """Evaluates all requirements on a design as one vector function ``c(x) >= 0``, in mm."""

    space: DesignSpace
    limits: Limits

    @cached_property
    def kinds(self) -> tuple[ConstraintKind, ...]:
        """Lists the requirements at the places that the design variables can change."""
        space = self.space
        ends = np.unique(space.turns.tocoo().row) + space.lattice.n_vertices
        return kinds(space.lattice, self.limits, np.append(space.free_vertices, ends))

    @property
    def n_constraints(self) -> int:
        """Counts the values."""
        return sum(len(kind.places) for kind in self.kinds)

    def __call__(self, design: Floats) -> tuple[Floats, sp.csr_array]:
        """Evaluates c (n_constraints,) at a design vector (n_variables,) and their sparse Jacobian.

        The pattern of the Jacobian (n_constraints, n_variables) never changes.
        """
        values, slopes = self._local(jnp.asarray(self._points(design)))
        pattern, scatter = self._scatter
        data = scatter @ np.asarray(slopes)
        shape = (self.n_constraints, self.space.n_variables)
        return np.array(values), sp.csr_array((data, *pattern), shape=shape)

    def values(self, design: Floats) -> Floats:
        """Evaluates c (n_constraints,) alone."""
        return np.array(self._local(jnp.asarray(self._points(design)))[0])

    def vertices(self, design: Floats) -> Floats:
        """Returns the vertices (n_vertices, 2) of a design vector."""
        return self._points(design)[: self.space.lattice.n_vertices]

    def _points(self, design: Floats) -> Floats:
        """Returns vertices and angles of slots (n_points, 2), as of `points`."""
        lattice = self.space.lattice
        shifts = (self._expansion @ design).reshape(-1, 2)
        return points(lattice, lattice.vertices) + shifts

    def margins(self, design: Floats) -> dict[str, Margin]:
        """Finds the smallest margin of each kind at the places that the design can change."""
        return worst(self.space.lattice, self.kinds, self._points(design))

    def named(self, number: int) -> tuple[str, str]:
        """Names the kind of one of the values, and the vertices and units that it is about."""
        for kind in self.kinds:
            if number < len(kind.places):
                return kind.name, vertices_of(self.space.lattice, kind.places[number])
            number -= len(kind.places)
        raise IndexError("there are not so many constraints")

    @cached_property
    def _local(self) -> Callable[[Array], tuple[Array, Array]]:
        requirements = self.kinds

        @jax.jit
        def local(at: Array) -> tuple[Array, Array]:
            parts = [kind.values_and_slopes(at) for kind in requirements]
            empty = jnp.zeros(0)
            return (
                jnp.concatenate([empty, *(values for values, _ in parts)]),
                jnp.concatenate([empty, *(slopes for _, slopes in parts)]),
            )

        return local

    @cached_property
    def _expansion(self) -> sp.csr_array:
        """Maps the design vector linearly to the shifts (2 n_points, n_variables) of points."""
        space = self.space
        position = np.full(space.lattice.n_groups, -1)
        position[space.groups] = np.arange(len(space.groups))
        row = position[space.lattice.group]
        free = np.flatnonzero(row >= 0)
        count = 2 * len(space.groups)
        entries = (2 * free[:, None] + [0, 1]).ravel(), (2 * row[free, None] + [0, 1]).ravel()
        ones = np.ones(2 * len(free))
        gather = sp.csr_array((ones, entries), shape=(2 * space.lattice.n_vertices, count))
        turned = space.turns.tocoo()
        angles = (turned.data, (2 * turned.row, turned.col))  # the first coordinates
        turns = sp.csr_array(angles, shape=(2 * turned.shape[0], turned.shape[1]))
        return sp.csr_array(sp.block_diag([gather @ space.basis, turns]))

    @cached_property
    def _scatter(self) -> tuple[tuple[Ints, Ints], sp.csr_array]:
        """Builds the pattern (indices, indptr) of the Jacobian and the map of slopes to it."""
        rows, coordinates = _slope_targets(self.kinds)
        spread = self._expansion[coordinates].tocoo()
        slope, variable = spread.coords
        key = rows[slope] * self.space.n_variables + variable
        filled, entry = np.unique(key, return_inverse=True)
        scatter = sp.csr_array((spread.data, (entry, slope)), shape=(len(filled), len(rows)))
        row_of, indices = np.divmod(filled, max(self.space.n_variables, 1))
        indptr = np.concatenate([[0], np.cumsum(np.bincount(row_of, minlength=self.n_constraints))])
        return (indices, indptr), scatter


def _slope_targets(requirements: tuple[ConstraintKind, ...]) -> tuple[Ints, Ints]:
    """Lists constraint row and point coordinate of every local slope, as they are evaluated."""
    rows, coordinates, start = [np.zeros(0, int)], [np.zeros(0, int)], 0
    for kind in requirements:
        flat = kind.places.reshape(len(kind.places), -1)
        own = (2 * flat[:, :, None] + [0, 1]).reshape(len(flat), 2 * flat.shape[1])
        rows.append(np.repeat(start + np.arange(len(flat)), own.shape[1]))
        coordinates.append(own.ravel())
        start += len(flat)
    return np.concatenate(rows), np.concatenate(coordinates)
