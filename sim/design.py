"""Design vector to vertices: which vertices are free, and which move together by symmetry."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp
from jax import Array

from sim.arrays import Floats, Ints, Numbers
from sim.lattice import Lattice

Symmetry = Literal["none", "C4", "mirror_x", "mirror_y"]

_OPERATIONS: dict[str, list[Floats]] = {
    "none": [],
    "C4": [np.array([[0.0, -1.0], [1.0, 0.0]])],
    "mirror_x": [np.diag([-1.0, 1.0])],
    "mirror_y": [np.diag([1.0, -1.0])],
}


@dataclass(frozen=True)
class DesignSpace:
    """Linear map from a design vector (mm) to the shifts of the lattice's vertices.

    Without symmetry the variables are the x and y shifts of the free groups, in the order of their
    numbers. With a symmetry each variable moves one orbit of them, by at most its own value.

    Attributes:
        lattice: the initial network; a zero design vector leaves it as it is.
        groups: (n_free,) free design groups.
        basis: (2 n_free, n_variables) columns of shifts, one per variable.
    """

    lattice: Lattice
    groups: Ints
    basis: Floats

    @property
    def n_variables(self) -> int:
        """Number of design variables."""
        return self.basis.shape[1]

    @cached_property
    def free_vertices(self) -> Ints:
        """Ids of the vertices that the design moves."""
        return np.flatnonzero(np.isin(self.lattice.group, self.groups))

    def vertices(self, design: Numbers) -> Array:
        """Vertex positions (n_vertices, 2) of a design vector (n_variables,), mm."""
        free_shifts = (jnp.asarray(self.basis) @ design).reshape(-1, 2)
        shifts = jnp.zeros((self.lattice.n_groups, 2)).at[self.groups].set(free_shifts)
        return jnp.asarray(self.lattice.vertices) + shifts[self.lattice.group]

    def project(self, shifts: Floats) -> Floats:
        """Design vector closest to the given group shifts (n_groups, 2), mm."""
        return np.asarray(np.linalg.lstsq(self.basis, shifts[self.groups].ravel(), rcond=None)[0])


def design_space(
    lattice: Lattice, cloak: Ints, frozen: Ints | None = None, symmetry: Symmetry = "none"
) -> DesignSpace:
    """Frees every vertex of the cloak's units except those of the ``frozen`` units.

    Args:
        lattice: the initial network.
        cloak: ids of the units to redesign.
        frozen: ids of units whose vertices must stay (the driven source).
        symmetry: imposed on the shifts, about the middle of the lattice.

    Raises:
        ValueError: the initial lattice or the choice of units does not have the symmetry.
    """
    free = np.zeros(lattice.n_groups, dtype=bool)
    free[lattice.group[np.isin(lattice.unit, cloak)]] = True
    if frozen is not None:
        free[lattice.group[np.isin(lattice.unit, frozen)]] = False
    groups = np.flatnonzero(free)
    return DesignSpace(lattice, groups, _symmetric_basis(lattice, groups, symmetry))


def _symmetric_basis(lattice: Lattice, groups: Ints, symmetry: Symmetry) -> Floats:
    """Orthogonal basis of the shifts of ``groups`` that the symmetry's operations leave alone."""
    size = 2 * len(groups)
    if symmetry == "none":
        return np.eye(size)
    projector = np.eye(size)
    for operation in _OPERATIONS[symmetry]:
        image = _group_image(lattice, groups, operation)
        permutation = sp.csr_matrix(
            (np.ones(len(groups)), (image, np.arange(len(groups)))), shape=(len(groups),) * 2
        )
        step = sp.kron(permutation, operation).toarray()
        powers = [np.eye(size)]
        while not np.allclose(nxt := step @ powers[-1], np.eye(size)):
            powers.append(nxt)
        projector = np.mean(powers, axis=0) @ projector
    return _orbit_basis(projector)


def _orbit_basis(projector: Floats) -> Floats:
    """Orthogonal columns spanning a projector's range, each on one orbit, largest entry 1."""
    columns: list[Floats] = []
    covered = np.zeros(len(projector), dtype=bool)
    for k in range(len(projector)):
        if covered[k]:
            continue
        column = projector[:, k]
        for other in columns:
            column = column - (other @ column) * other
        norm = np.linalg.norm(column)
        if norm > 1e-9:
            columns.append(column / norm)
            covered |= np.abs(column) > 1e-9
    return np.stack([column / np.abs(column).max() for column in columns], axis=1)


def _group_image(lattice: Lattice, groups: Ints, operation: Floats) -> Ints:
    """Position in ``groups`` of the image of each group under an operation about the middle."""
    middle = (lattice.site.min(axis=0) + lattice.site.max(axis=0)) / 2
    centre = np.zeros((lattice.n_groups, 2))
    count = np.bincount(lattice.group, minlength=lattice.n_groups)
    np.add.at(centre, lattice.group, lattice.vertices - middle)
    centre = (centre / count[:, None])[groups]
    distance = np.linalg.norm((centre @ operation.T)[:, None] - centre[None], axis=2)
    image = distance.argmin(axis=1)
    if len(groups) and distance.min(axis=1).max() > 1e-6 * lattice.spacing:
        raise ValueError("the initial lattice or its cloak does not have this symmetry")
    return image
