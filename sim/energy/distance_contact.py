"""Defines the energy of two units that are close: a barrier on the true distance of their outlines.

Outlines that do not cross come closest between a vertex of the one and an edge, or a vertex, of the
other. The distance from a vertex to an edge with its ends is only once differentiable where the
nearest point reaches an end, so the two kinds are kept apart: each pair of vertices has a barrier
on their distance, and each vertex and edge one on the distance to the edge's line, that fades out
within one activation distance from either end. Their sum is twice continuously differentiable in
the vertices of both, zero for units farther apart than the activation distance, and unbounded at a
touch anywhere. It is the definition that the compiled kernels
(sim/energy/distance_contact_kernels.py) are tested against.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Numbers
from sim.energy.ligament import rotate


class DistanceLaw(NamedTuple):
    """Describes contact of two units on their distance."""

    # scale of the barrier, N mm: k (distance / ligament length)^2 with the contact stiffness k of
    # the angle law (N mm/rad^2), since a void that closes by an angle moves its sides by that times
    # the ligament length
    energy: float | Array
    distance: float  # activation distance, mm; beyond it there is no contact


class UnitOutline(NamedTuple):
    """Holds a unit: its centroid (2,) and the arms (n, 2) to its vertices, at rest, mm."""

    centroid: Numbers
    corner: Numbers


def barrier(square: Array, law: DistanceLaw) -> Array:
    """Computes energy (1 - q)^3 / q at a squared distance (mm^2), with q = square / distance^2."""
    q = jnp.minimum(square / law.distance**2, 1.0)
    return law.energy * (1.0 - q) ** 3 / q


def fade(length: Array, law: DistanceLaw) -> Array:
    """Weighs an edge at a length (mm) from its end: from 0 to 1 over the distance, quintic."""
    x = jnp.clip(length / law.distance, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def vertices_energy(one: Array, other: Array, law: DistanceLaw) -> Array:
    """Computes the energy between two vertices (2,), N mm."""
    return barrier(jnp.sum((one - other) ** 2), law)


def edge_energy(vertex: Array, start: Array, end: Array, law: DistanceLaw) -> Array:
    """Computes the energy between a vertex (2,) and an edge, its polygon on the left, N mm.

    It is zero on the inner side: a vertex gets there from beyond another edge only.
    """
    edge, offset = end - start, vertex - start
    length = jnp.linalg.norm(edge)
    along = jnp.dot(offset, edge) / length
    across = (offset[0] * edge[1] - offset[1] * edge[0]) / length
    outside = across > 0.0
    height = jnp.where(outside, across, law.distance)
    weight = fade(along, law) * fade(length - along, law)
    return jnp.where(outside, weight * barrier(height**2, law), 0.0)


def move_polygon(motion: Array, polygon: UnitOutline) -> Array:
    """Vertices (n, 2) of a unit after a motion (3,)."""
    turned = jax.vmap(rotate, (0, None))(jnp.asarray(polygon.corner), motion[2])
    return jnp.asarray(polygon.centroid) + motion[:2] + turned


def pair_energy(
    motion_a: Array, motion_b: Array, a: UnitOutline, b: UnitOutline, law: DistanceLaw
) -> Array:
    """Computes the contact energy of two units that do not overlap, N mm.

    Motions (3,) are displacement (mm) and rotation (rad); vertices of the units are counter-
    clockwise.
    """
    one, other = move_polygon(motion_a, a), move_polygon(motion_b, b)
    between = jnp.vectorize(vertices_energy, signature="(2),(2)->()", excluded={2})
    ends = between(one[:, None], other[None], law)
    return ends.sum() + _edges(one, other, law) + _edges(other, one, law)


def _edges(vertices: Array, ring: Array, law: DistanceLaw) -> Array:
    towards = jnp.vectorize(edge_energy, signature="(2),(2),(2)->()", excluded={3})
    return towards(vertices[:, None], ring[None], jnp.roll(ring, -1, axis=0)[None], law).sum()


def activation_distance(ligament_length: float, gap: float | None = None) -> float:
    """Returns the default activation distance: a twelfth of a ligament, or the smallest gap, mm.

    Units of a design that keeps a ``gap`` above zero do not push each other at rest; and the ends
    of a ligament, joined but not in contact, are far beyond it.
    """
    return min(ligament_length / 12.0, gap or np.inf)
