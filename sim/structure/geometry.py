"""Derives the shape of the units from the vertices, in JAX: centroid, inertia, arms, angles."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from sim.core import Floats, Ints, Numbers
from sim.structure.angles import angle_between
from sim.structure.lattice import Lattice


class Shape(NamedTuple):
    """Holds the reference shape of a network."""

    centroid: Array  # (n_units, 2) mm
    area: Array  # (n_units,) mm^2
    polar_moment: Array  # (n_units,) about the centroid, mm^4
    arm: Array  # (n_vertices, 2) centroid to vertex, mm
    void_angle: Array  # (n_ligaments, 2) opening on the two sides of each ligament, rad


def shape(lattice: Lattice, vertices: Numbers) -> Shape:
    """Computes the shape of the network with its ``vertices`` (n_vertices, 2) there, in mm."""
    return _shape(arrays_of(lattice), jnp.asarray(vertices))


class LatticeArrays(NamedTuple):
    """Holds the arrays of a `Lattice` that functions are compiled for."""

    unit: Ints
    site: Floats
    ligaments: Ints
    ligament_vectors: Floats
    next_vertex: Ints
    previous_vertex: Ints
    void_branch: Floats

    @property
    def n_units(self) -> int:
        """Counts the units."""
        return len(self.site)


def arrays_of(lattice: Lattice) -> LatticeArrays:
    """Collects the arrays of a lattice."""
    return LatticeArrays(*(getattr(lattice, name) for name in LatticeArrays._fields))


@jax.jit
def _shape(lattice: LatticeArrays, vertices: Array) -> Shape:
    """Compiles all at once: that is sooner done than each operation by itself."""
    centroid, area, polar_moment = inertia(lattice, vertices)
    arm = vertices - centroid[lattice.unit]
    return Shape(centroid, area, polar_moment, arm, void_angles(lattice, vertices))


def inertia(lattice: Lattice | LatticeArrays, vertices: Numbers) -> tuple[Array, Array, Array]:
    """Computes centroid, area and polar moment about the centroid of each polygon (shoelace sums).

    Vertices are taken relative to the lattice point: the sums cancel badly far from the origin.
    """

    def total(values: Array) -> Array:
        return jax.ops.segment_sum(values, lattice.unit, lattice.n_units)

    here = jnp.asarray(vertices) - lattice.site[lattice.unit]
    there = here[lattice.next_vertex]
    cross = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    # A = sum(c) / 2, s = sum((a + b) c) / 6 A, J = sum(c (a.a + a.b + b.b)) / 12 - A s.s, c = a x b
    area = total(cross) / 2
    offset = total((here + there) * cross[:, None]) / (6 * area[:, None])
    squares = jnp.sum(here * here + here * there + there * there, axis=1)
    polar_moment = total(cross * squares) / 12 - area * jnp.sum(offset**2, axis=1)
    return jnp.asarray(lattice.site) + offset, area, polar_moment


def void_angles(lattice: Lattice | LatticeArrays, vertices: Numbers) -> Array:
    """Measures the signed, unwrapped void angles (n_ligaments, 2) beside each ligament, rad.

    The first lies between the clockwise edge of the second end and the counter-clockwise edge of
    the first end, the second on the other side (DifFlexMM's convention). Under a motion of rigid
    units a and b they change by exactly theta_a - theta_b and theta_b - theta_a. A turn is added
    below the branch of a void, which the initial lattice tells.
    """
    first, second = lattice.ligaments.T
    one = angle_between(
        vertices[lattice.previous_vertex[second]] - vertices[second],
        vertices[lattice.next_vertex[first]] - vertices[first],
    )
    other = angle_between(
        vertices[lattice.previous_vertex[first]] - vertices[first],
        vertices[lattice.next_vertex[second]] - vertices[second],
    )
    return unwrap(jnp.stack([one, other], axis=1), lattice.void_branch)


def unwrap(angle: Numbers, branch: float | Array | Floats) -> Array:
    """Moves angles on (-pi, pi] to [branch, branch + 2 pi)."""
    return jnp.where(angle < branch, angle + 2 * jnp.pi, angle)
