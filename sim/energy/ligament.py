"""Defines the energy of one ligament, from which all else is derived.

The compiled kernels (sim/energy/ligament_kernels.py) are tested against the automatic
derivatives of these functions.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array


class LigamentLaw(NamedTuple):
    """Stiffness of a ligament: axial and shear in N/mm, bending in N mm/rad."""

    axial: float | Array
    shear: float | Array
    bending: float | Array


def rotate(vector: Array, angle: Array) -> Array:
    """Rotates a 2-vector counter-clockwise."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    return jnp.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


class LigamentStrain(NamedTuple):
    """Holds the strain of a ligament: stretch (mm), shear angle and relative rotation (rad)."""

    stretch: Array
    shear: Array
    bend: Array


def ligament_strain(
    motion_a: Array, motion_b: Array, arm_a: Array, arm_b: Array, vector: Array
) -> LigamentStrain:
    """Computes the strain of one ligament in large rotation.

    Args:
        motion_a: (3,) displacement (mm) and rotation (rad) of the first unit.
        motion_b: the same of the second.
        arm_a: (2,) reference vector from the first unit's centroid to the ligament's end, mm.
        arm_b: the same of the second.
        vector: (2,) reference vector of the ligament, mm.

    The shear angle is measured from the direction that the mean rotation of the two units gives the
    ligament, so it needs no unwrapping (Bordiga et al. 2025, SI; DifFlexMM).
    """
    current = (
        vector
        + (motion_b[:2] + rotate(arm_b, motion_b[2]) - arm_b)
        - (motion_a[:2] + rotate(arm_a, motion_a[2]) - arm_a)
    )
    carried = rotate(vector, (motion_a[2] + motion_b[2]) / 2)
    shear = jnp.arctan2(
        carried[0] * current[1] - carried[1] * current[0], jnp.dot(carried, current)
    )
    stretch = jnp.linalg.norm(current) - jnp.linalg.norm(vector)
    return LigamentStrain(stretch, shear, motion_b[2] - motion_a[2])


def ligament_energy(
    motion_a: Array,
    motion_b: Array,
    arm_a: Array,
    arm_b: Array,
    vector: Array,
    law: LigamentLaw,
    natural: Array | Sequence[float] = (0.0, 0.0, 0.0),
) -> Array:
    """Computes the strain energy of one ligament of the given law, N mm; see ``ligament_strain``.

    It is zero at the ``natural`` (3,) stretch (mm), shear angle and relative rotation (rad).
    """
    strain = ligament_strain(motion_a, motion_b, arm_a, arm_b, vector)
    reference_length = jnp.linalg.norm(vector)
    return 0.5 * (
        law.axial * (strain.stretch - natural[0]) ** 2
        + law.shear * (reference_length * (strain.shear - natural[1])) ** 2
        + law.bending * (strain.bend - natural[2]) ** 2
    )
