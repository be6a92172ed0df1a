"""Derives structures with prestressed ligaments at rest: places, natural strains, parameters."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from sim.core import Numbers
from sim.energy.ligament import ligament_strain
from sim.structure import Lattice, LatticeArrays, Parameters


class RestState(NamedTuple):
    """Holds a prestressed structure at rest."""

    vertices: Array  # (n_vertices, 2) there, mm
    vector: Array  # (n_ligaments, 2) ligaments there, mm
    shear_stiffness: Array  # (n_ligaments,) for their length there, N/mm
    # (n_ligaments, 3) stretch, mm, shear angle and relative rotation, rad, from there, at which
    # ligaments are free of stress
    natural: Array


def rest_state(
    lattice: Lattice | LatticeArrays, values: Parameters[Any], motion: Numbers
) -> RestState:
    """Moves units as rigid bodies, and computes the natural states of their ligaments.

    So energies and forces of a motion from there are those of the motion before and from there. The
    values are those of the structure as designed, `motion` (n_units, 3) leads from there to rest,
    mm, mm, rad.
    """
    values, motion = jax.tree.map(jnp.asarray, values), jnp.asarray(motion)
    turn = motion[lattice.unit, 2]
    arm, cosine, sine = values.corner, jnp.cos(turn), jnp.sin(turn)
    turned = jnp.stack(
        [cosine * arm[:, 0] - sine * arm[:, 1], sine * arm[:, 0] + cosine * arm[:, 1]], axis=1
    )
    vertices = values.centroid[lattice.unit] + motion[lattice.unit, :2] + turned
    first, second = lattice.ligaments.T
    vector = vertices[second] - vertices[first]
    ends: Array = motion[lattice.unit[lattice.ligaments]]
    strain = jax.vmap(ligament_strain)(
        ends[:, 0], ends[:, 1], values.arm[:, 0], values.arm[:, 1], values.vector
    )
    before, after = (jnp.linalg.norm(each, axis=1) for each in (values.vector, vector))
    # k_s (l0 gamma)^2 knows the length as designed
    shear = values.law[:, 1] * (before / after) ** 2
    return RestState(vertices, vector, shear, values.natural - jnp.stack(strain, axis=1))


def parameters_at_rest(
    lattice: Lattice | LatticeArrays, values: Parameters[Array], motion: Array
) -> Parameters[Array]:
    """Derives the parameters of a structure as it rests; arguments of `rest_state`."""
    rest, unit = rest_state(lattice, values, motion), lattice.unit
    centroid = values.centroid + motion[:, :2]
    corner = rest.vertices - centroid[unit]
    return values._replace(
        arm=corner[lattice.ligaments],
        vector=rest.vector,
        void=values.void + _void_opening(lattice, motion),
        law=values.law.at[:, 1].set(rest.shear_stiffness),
        natural=rest.natural,
        corner=corner,
        centroid=centroid,
    )


def _void_opening(lattice: Lattice | LatticeArrays, motion: Array) -> Array:
    """Computes by how much void angles (n_ligaments, 2) grow, rad; see `void_angles`."""
    a, b = lattice.unit[lattice.ligaments].T
    more = motion[a, 2] - motion[b, 2]
    return jnp.stack([more, -more], axis=1)
