"""Defines the energy of contact on a void angle, which the compiled kernels are tested against."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array


class ContactLaw(NamedTuple):
    """Describes contact of two units on the void angle: N mm/rad^2, rad, rad."""

    stiffness: float | Array
    barrier: float | Array
    cutoff: float | Array


def contact_energy(void_angle: float | Array, law: ContactLaw) -> Array:
    """Computes the energy of one void that closes below the cutoff, infinite at the barrier, N mm.

    With x = (angle - cutoff) / (cutoff - barrier) it is k/4 (cutoff - barrier)^2 (1/(x+1) - 1/(x-1)
    - 2), which is k/2 (angle - cutoff)^2 / (1 - x^2). Beyond the barrier the authors' law is
    silently zero; here it is infinite: a state there is not admissible.
    """
    width = law.cutoff - law.barrier
    x = jnp.minimum(void_angle - law.cutoff, 0.0) / width
    inside = x > -1
    energy = law.stiffness / 2 * (width * x) ** 2 / (1 - jnp.where(inside, x, 0.0) ** 2)
    return jnp.where(inside, energy, jnp.inf)


def contact_void_angles(void_angle: Array, rotation_a: Array, rotation_b: Array) -> Array:
    """Computes the current void angles (2,) of a ligament; exact, since the units are rigid."""
    turn = rotation_a - rotation_b
    return void_angle + jnp.array([turn, -turn])
