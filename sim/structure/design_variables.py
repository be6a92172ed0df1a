"""Maps design vectors to vertices and angles of slots: the free ones, alike by symmetry."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp
from jax import Array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from sim.core import Floats, Ints, Numbers
from sim.structure.lattice import Lattice

Symmetry = Literal["none", "C4", "mirror_x", "mirror_y"]

ANGLE_LENGTH = 5.0
"""Length (mm) that turns an angle in radians into a length comparable to those of units, in mm."""

_OPERATIONS: dict[str, list[Floats]] = {
    "none": [],
    "C4": [np.array([[0.0, -1.0], [1.0, 0.0]])],
    "mirror_x": [np.diag([-1.0, 1.0])],
    "mirror_y": [np.diag([1.0, -1.0])],
}


@dataclass(frozen=True)
class DesignSpace:
    """Maps a design vector (mm) linearly to the shifts of the lattice's vertices.

    Without symmetry the variables are the x and y shifts of the free groups, in the order of their
    numbers. With a symmetry each variable moves one orbit of them, by at most its own value. Where
    the slots that hold ligaments turn as well, their angles come after, times ``ANGLE_LENGTH``.
    """

    lattice: Lattice  # the initial network; a zero design vector leaves it as it is
    groups: Ints  # (n_free,) free design groups
    basis: sp.csr_array  # (2 n_free, n_shifts) orthogonal columns of shifts, one per variable
    # (2 n_ligaments, n_turns) orthogonal columns of the angles at the first and second end of each
    # ligament, one per variable; none where slots do not turn
    turns: sp.csr_array

    @property
    def n_variables(self) -> int:
        """Counts the design variables."""
        return self.basis.shape[1] + self.turns.shape[1]

    @property
    def turning(self) -> bool:
        """Tests that the slots that hold ligaments turn with the design."""
        return self.turns.shape[1] > 0

    @cached_property
    def free_vertices(self) -> Ints:
        """Lists the ids of the vertices that the design moves."""
        return np.flatnonzero(np.isin(self.lattice.group, self.groups))

    def vertices(self, design: Numbers) -> Array:
        """Returns the vertices (n_vertices, 2) of a design vector (n_variables,), mm.

        Raises:
            ValueError: it has another number of variables.
        """
        given = jnp.asarray(design)
        if given.shape != (self.n_variables,):  # JAX takes others without a word
            raise ValueError(
                f"a design of shape {given.shape} is given where ({self.n_variables},) is wanted:"
                " one number for each variable; take the design of this scene"
            )
        start, shifting = self.lattice.vertices, given[: self.basis.shape[1]]
        free_shifts = _product(self.basis, shifting).reshape(-1, 2)
        return _shifted(start, self.lattice.group, self.groups, free_shifts)

    def end_angles(self, design: Numbers) -> Array:
        """Returns the angles (n_ligaments, 2) of slots against their ligaments, rad."""
        turning = jnp.asarray(design)[self.basis.shape[1] :] / ANGLE_LENGTH
        return _product(self.turns, turning).reshape(-1, 2)

    def project(self, shifts: Floats, end_angles: Floats | None = None) -> Floats:
        """Finds the design vector closest to the given group shifts (n_groups, 2), mm.

        Likewise to the angles (n_ligaments, 2) of slots, rad; by default they are zero.
        """
        angles = np.zeros(self.turns.shape[0]) if end_angles is None else end_angles.ravel()
        parts = (self.basis, shifts[self.groups].ravel()), (self.turns, ANGLE_LENGTH * angles)
        # of orthogonal columns
        return np.concatenate([basis.T @ of / basis.power(2).sum(axis=0) for basis, of in parts])


@jax.jit
def _shifted(vertices: Floats, group: Ints, groups: Ints, free_shifts: Array) -> Array:
    """Shifts vertices by those (n_free, 2) of their groups, if these are free."""
    shifts = jnp.zeros_like(vertices).at[groups].set(free_shifts)  # no more groups than vertices
    return jnp.asarray(vertices) + shifts[group]


def _product(matrix: sp.csr_array, vector: Array) -> Array:
    """Multiplies a sparse matrix (n, m) by a vector (m,); differentiable by the vector."""
    entries = matrix.tocoo()
    return _summed(entries.data, entries.row, entries.col, vector, matrix.shape[0])


@partial(jax.jit, static_argnames="length")
def _summed(data: Floats, row: Ints, column: Ints, vector: Array, length: int) -> Array:
    """Sums terms of a product by row (length,)."""
    return jnp.zeros(length).at[row].add(data * vector[column])


def design_space(
    lattice: Lattice,
    cloak: Ints,
    frozen: Ints | None = None,
    symmetry: Symmetry = "none",
    turning: bool = False,
) -> DesignSpace:
    """Frees every vertex of the cloak's units except those of the ``frozen`` units, the source.

    The symmetry is imposed on the shifts, about the middle of the lattice; `turning` tells whether
    the slots of all units with a free vertex turn as well.

    Raises:
        ValueError: the initial lattice or the choice of units does not have the symmetry.
    """
    free = np.zeros(lattice.n_groups, dtype=bool)
    free[lattice.group[np.isin(lattice.unit, cloak)]] = True
    if frozen is not None:
        free[lattice.group[np.isin(lattice.unit, frozen)]] = False
    groups = np.flatnonzero(free)
    steps = [
        sp.kron(_permutation(_group_image(lattice, groups, operation)), operation)
        for operation in _OPERATIONS[symmetry]
    ]
    turned = np.isin(lattice.unit, np.unique(lattice.unit[free[lattice.group]]))
    ends = np.flatnonzero(turned[lattice.ligaments.ravel()]) if turning else groups[:0]
    turns = sp.csr_array((2 * lattice.n_ligaments, 0))
    if len(ends):
        of_ends = [
            np.linalg.det(operation) * _permutation(_end_image(lattice, ends, operation))
            for operation in _OPERATIONS[symmetry]
        ]
        placed = (np.ones(len(ends)), (ends, np.arange(len(ends))))
        shape = (2 * lattice.n_ligaments, len(ends))
        turns = sp.csr_array(placed, shape=shape) @ _symmetric_basis(len(ends), of_ends)
    return DesignSpace(lattice, groups, _symmetric_basis(2 * len(groups), steps), turns)


def _permutation(image: Ints) -> sp.csr_array:
    """Builds the matrix that moves each value to its image."""
    ones, order = np.ones(len(image)), np.arange(len(image))
    return sp.csr_array((ones, (image, order)), shape=(len(image),) * 2)


def _symmetric_basis(count: int, steps: Sequence[sp.sparray]) -> sp.csr_array:
    """Builds an orthogonal basis of the vectors (count,) that do not change by operations.

    `steps` (count, count) are signed permutations, each some power of which is the identity.
    """
    identity = sp.csr_array(sp.eye_array(count))
    projector = identity
    for step in steps:
        powers = [identity]
        while abs((following := sp.csr_array(step) @ powers[-1]) - identity).max() > 0.0:
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
    centre = np.zeros((lattice.n_groups, 2))
    count = np.bincount(lattice.group, minlength=lattice.n_groups)
    np.add.at(centre, lattice.group, lattice.vertices)
    return _image(lattice, (centre / count[:, None])[groups], operation)


def _end_image(lattice: Lattice, ends: Ints, operation: Floats) -> Ints:
    """Finds the image of each end of a ligament, by place in ``ends``: its unit goes with it."""
    middle = lattice.vertices[lattice.ligaments].mean(axis=1)
    # a point of the ligament nearer to this end
    near = (lattice.vertices[lattice.ligaments] + middle[:, None]).reshape(-1, 2) / 2
    return _image(lattice, near[ends], operation)


def _image(lattice: Lattice, points: Floats, operation: Floats) -> Ints:
    """Finds the image (n,) of points (n, 2) among them under an operation about the middle."""
    about = points - (lattice.site.min(axis=0) + lattice.site.max(axis=0)) / 2
    distance, image = KDTree(about).query(about @ operation.T)
    if len(points) and distance.max() > 1e-6 * lattice.spacing:
        raise ValueError("the initial lattice or its cloak does not have this symmetry")
    return np.asarray(image)
