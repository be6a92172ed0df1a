"""Maps design vectors to vertices: the free ones, and those that move together by symmetry."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp
from jax import Array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from sim.core import Floats, Ints, Numbers
from sim.structure.lattice import Lattice

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
        basis: (2 n_free, n_variables) orthogonal columns of shifts, one per variable.
    """

    lattice: Lattice
    groups: Ints
    basis: sp.csr_array

    @property
    def n_variables(self) -> int:
        """Counts the design variables."""
        return self.basis.shape[1]

    @cached_property
    def free_vertices(self) -> Ints:
        """Lists the ids of the vertices that the design moves."""
        return np.flatnonzero(np.isin(self.lattice.group, self.groups))

    def vertices(self, design: Numbers) -> Array:
        """Returns the vertices (n_vertices, 2) of a design vector (n_variables,), mm."""
        basis = self.basis.tocoo()
        moved = jnp.asarray(basis.data) * jnp.asarray(design)[basis.col]
        free_shifts = jnp.zeros(basis.shape[0]).at[basis.row].add(moved).reshape(-1, 2)
        shifts = jnp.zeros((self.lattice.n_groups, 2)).at[self.groups].set(free_shifts)
        return jnp.asarray(self.lattice.vertices) + shifts[self.lattice.group]

    def project(self, shifts: Floats) -> Floats:
        """Finds the design vector closest to the given group shifts (n_groups, 2), mm."""
        square = self.basis.power(2).sum(axis=0)  # of orthogonal columns
        return np.asarray(self.basis.T @ shifts[self.groups].ravel() / square)


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


def _symmetric_basis(lattice: Lattice, groups: Ints, symmetry: Symmetry) -> sp.csr_array:
    """Builds an orthogonal basis of the shifts of ``groups`` that the symmetry allows."""
    identity = sp.csr_array(sp.eye_array(2 * len(groups)))
    projector = identity
    for operation in _OPERATIONS[symmetry]:
        image = _group_image(lattice, groups, operation)
        ones, order = np.ones(len(groups)), np.arange(len(groups))
        permutation = sp.csr_array((ones, (image, order)), shape=(len(groups),) * 2)
        step = sp.csr_array(sp.kron(permutation, operation))
        powers = [identity]
        while abs((following := step @ powers[-1]) - identity).max() > 0.0:
            powers.append(following)
        projector = sum(powers[1:], powers[0]) @ projector / len(powers)
    return _orbits(projector)


def _orbits(projector: sp.csr_array) -> sp.csr_array:
    """Picks columns that span a projector's range, one for each orbit of signed permutations.

    Their largest entry is 1; an orbit that a symmetry holds in place has none.
    """
    if projector.shape[0] == 0:
        return projector
    _, orbit = connected_components(projector, directed=False)
    _, first = np.unique(orbit, return_index=True)
    columns = projector[:, np.sort(first)]
    largest = abs(columns).max(axis=0).toarray().ravel()
    moving = np.flatnonzero(largest)
    return sp.csr_array(columns[:, moving] @ sp.diags_array(1.0 / largest[moving]))


def _group_image(lattice: Lattice, groups: Ints, operation: Floats) -> Ints:
    """Finds the image of each group under an operation about the middle, by place in ``groups``."""
    middle = (lattice.site.min(axis=0) + lattice.site.max(axis=0)) / 2
    centre = np.zeros((lattice.n_groups, 2))
    count = np.bincount(lattice.group, minlength=lattice.n_groups)
    np.add.at(centre, lattice.group, lattice.vertices - middle)
    centre = (centre / count[:, None])[groups]
    distance, image = KDTree(centre).query(centre @ operation.T)
    if len(groups) and distance.max() > 1e-6 * lattice.spacing:
        raise ValueError("the initial lattice or its cloak does not have this symmetry")
    return np.asarray(image)
