"""Derives the parameters of a structure, by which a solve can be differentiated."""

from typing import Generic, NamedTuple, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
from jax import Array

from sim.core import Floats, Numbers
from sim.structure.geometry import LatticeArrays, Shape, arrays_of, shape
from sim.structure.lattice import Lattice
from sim.structure.material import Material

A = TypeVar("A")


class Parameters(NamedTuple, Generic[A]):
    """Holds all that a response depends on differentiably, besides the drive."""

    arm: A  # (n_ligaments, 2, 2) arms of both ends, mm
    vector: A  # (n_ligaments, 2) reference ligament vectors, mm
    void: A  # (n_ligaments, 2) reference void angles, rad
    law: A  # (n_ligaments, 3) axial, shear, bending stiffness
    # (n_ligaments, 3) stretch, mm, shear angle and relative rotation, rad, at which the ligaments
    # are free of stress
    natural: A
    contact: A  # (n_ligaments,) contact stiffness, N mm/rad^2
    corner: A  # (n_vertices, 2) arms of all vertices, mm
    centroid: A  # (n_units, 2) mm
    mass: A  # (n_units, 3) tonne, tonne, tonne mm^2
    damping: A  # (n_units, 3) tonne/s, tonne/s, tonne mm^2/s


ConcreteParameters: TypeAlias = Parameters[Floats]
"""Concrete parameters, as the solvers take them."""


def parameters(
    lattice: Lattice | LatticeArrays, shape: Shape, material: Material
) -> Parameters[Array]:
    """Derives the parameters of a network; differentiable in shape and material."""
    n_ligaments, n_units = len(lattice.ligaments), len(shape.area)
    stiffness = (material.axial_stiffness, material.shear_stiffness, material.bending_stiffness)
    angles = jnp.broadcast_to(jnp.asarray(material.end_angles, dtype=float), (n_ligaments, 2))
    # a strip straight by itself, clamped at angles a and b to its chord, is so if the units turn by
    # -a and -b about its ends: gamma = -(mean rotation) = (a + b) / 2, kappa = a - b
    natural = (material.elongation, angles.mean(axis=1), angles[:, 0] - angles[:, 1])
    mass, inertia = material.density * shape.area, material.density * shape.polar_moment
    damping = (
        material.damping_translation,
        material.damping_translation,
        material.damping_rotation,
    )
    contact = jnp.asarray(material.contact_stiffness, dtype=float)
    return Parameters(
        arm=shape.arm[lattice.ligaments],
        vector=jnp.asarray(lattice.ligament_vectors),
        void=shape.void_angle,
        law=jnp.stack([jnp.broadcast_to(k, (n_ligaments,)) for k in stiffness], axis=1),
        natural=jnp.stack([jnp.broadcast_to(e, (n_ligaments,)) for e in natural], axis=1),
        contact=jnp.broadcast_to(contact, (n_ligaments,)),
        corner=shape.arm,
        centroid=shape.centroid,
        mass=jnp.stack([mass, mass, inertia], axis=1),
        damping=jnp.stack([jnp.broadcast_to(c, (n_units,)) for c in damping], axis=1),
    )


def parameters_at(lattice: Lattice, vertices: Numbers, material: Material) -> Parameters[Array]:
    """Computes the parameters of a network with its ``vertices`` (n_vertices, 2) there, in mm."""
    return _parameters(arrays_of(lattice), shape(lattice, vertices), material)


_parameters = jax.jit(parameters)
"""Compiles all at once: that is sooner done than each operation by itself."""
