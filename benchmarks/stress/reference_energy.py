"""Evaluates the structure by the definition of its energy, not by the solvers' kernels.

Forces and stiffness are automatic derivatives of ``sim.energy.ligament`` and
``sim.energy.distance_contact``, put together
ligament by ligament; which units are near one another is found by computational geometry.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp
from jax import Array

from sim.core import Floats, Ints
from sim.energy import (
    ContactLaw,
    DistanceLaw,
    LigamentLaw,
    UnitOutline,
    contact_energy,
    contact_void_angles,
    ligament_energy,
    pair_energy,
)
from sim.structure import (
    ConcreteParameters,
    ContactModel,
    DistanceContact,
    Lattice,
    VoidAngleContact,
    close_pairs,
    displaced,
)


class ReferenceStructure(NamedTuple):
    """Holds the inputs of the definition."""

    lattice: Lattice  # its polygons, all with the same number of corners
    vertices: Floats  # (n_vertices, 2) where they are at rest, mm
    values: ConcreteParameters  # of its parameters
    contact: ContactModel  # law by which units touch


class ReferenceForces(NamedTuple):
    """Holds energy (N mm) and force (n_dofs,) on the units, N and N mm."""

    energy: float
    force: Floats


def _ligament(motions: Array, values: ConcreteParameters, angles: Array) -> Array:
    """Computes the energy of one ligament, whose units move by (2, 3), and of its voids."""
    law = LigamentLaw(values.law[0], values.law[1], values.law[2])
    arms, vector = jnp.asarray(values.arm), jnp.asarray(values.vector)
    strain = ligament_energy(
        motions[0], motions[1], arms[0], arms[1], vector, law, jnp.asarray(values.natural)
    )
    contact = ContactLaw(jnp.asarray(values.contact), angles[0], angles[1])
    voids = contact_void_angles(jnp.asarray(values.void), motions[0, 2], motions[1, 2])
    return strain + contact_energy(voids[0], contact) + contact_energy(voids[1], contact)


_LAYOUT = (0, ConcreteParameters(0, 0, 0, 0, 0, 0, None, None, None, None), None)
_ligaments = jax.jit(jax.vmap(jax.value_and_grad(_ligament), _LAYOUT))
_ligament_blocks = jax.jit(jax.vmap(jax.hessian(_ligament), _LAYOUT))


def _pair(motions: Array, centroids: Array, corners: Array, law: DistanceLaw) -> Array:
    one, other = (UnitOutline(centroids[k], corners[k]) for k in (0, 1))
    return pair_energy(motions[0], motions[1], one, other, law)


_pairs = jax.jit(jax.vmap(jax.value_and_grad(_pair), (0, 0, 0, None)))
_pair_blocks = jax.jit(jax.vmap(jax.hessian(_pair), (0, 0, 0, None)))
PADDING = 64
"""Pairs are evaluated in multiples of so many: JAX compiles for every new number."""


def balance(of: ReferenceStructure, state: Floats) -> ReferenceForces:
    """Computes energy and force in a state (n_dofs,)."""
    motion = state.reshape(-1, 3)
    units = of.lattice.ligament_units
    energy, slope = _ligaments(motion[units], of.values, _angles(of))
    total, force = float(np.sum(energy)), np.zeros_like(motion)
    np.subtract.at(force, units, np.asarray(slope))
    if isinstance(of.contact, DistanceContact):
        pairs, given = _pairs_in_contact(of, state)
        energy, slope = _pairs(*given)
        total += float(np.sum(np.asarray(energy)[: len(pairs)]))
        np.subtract.at(force, pairs, np.asarray(slope)[: len(pairs)])
    return ReferenceForces(total, force.ravel())


def stiffness(of: ReferenceStructure, state: Floats) -> sp.csc_array:
    """Computes the Hessian (n_dofs, n_dofs) of the energy in a state (n_dofs,)."""
    motion = state.reshape(-1, 3)
    units = of.lattice.ligament_units
    blocks = np.asarray(_ligament_blocks(motion[units], of.values, _angles(of)))
    if isinstance(of.contact, DistanceContact):
        pairs, given = _pairs_in_contact(of, state)
        units = np.concatenate([units, pairs])
        blocks = np.concatenate([blocks, np.asarray(_pair_blocks(*given))[: len(pairs)]])
    dofs = (3 * units[:, :, None] + np.arange(3)).reshape(-1, 6)
    rows, columns = np.repeat(dofs, 6, axis=1).ravel(), np.tile(dofs, 6).ravel()
    return sp.csc_array((blocks.ravel(), (rows, columns)), shape=(len(state),) * 2)


def _angles(of: ReferenceStructure) -> Floats:
    """Returns barrier and cutoff, out of reach where contact acts on the distance of units."""
    law = of.contact
    if isinstance(law, VoidAngleContact):
        return np.array([law.barrier_angle, law.cutoff_angle])
    return np.array([-1e3, -1e3 + 1.0])


def _pairs_in_contact(
    of: ReferenceStructure, state: Floats
) -> tuple[Ints, tuple[Floats, Floats, Floats, DistanceLaw]]:
    """Finds pairs of units in contact; returns them, and padded as the definition takes them."""
    assert isinstance(of.contact, DistanceContact)
    reach = of.contact.distance
    moved = displaced(of.lattice, of.vertices, state.reshape(1, -1, 3))[0]
    pairs = close_pairs(of.lattice, moved, reach)
    room = -(-max(len(pairs), 1) // PADDING) * PADDING
    padded = np.concatenate([pairs, np.tile([[0, 1]], (room - len(pairs), 1))])
    length = np.linalg.norm(of.lattice.ligament_vectors, axis=1).mean()
    scale = (reach / length) ** 2
    law = DistanceLaw(float(of.values.contact.mean() * scale), reach)
    corners = of.values.corner.reshape(of.lattice.n_units, -1, 2)
    return pairs, (state.reshape(-1, 3)[padded], of.values.centroid[padded], corners[padded], law)
