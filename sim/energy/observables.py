"""Computes energies and reactions of given states."""

from typing import NamedTuple

import numpy as np

from sim.collision import raise_new_pairs
from sim.core import Floats, Ints, NewContactPairs, compiled
from sim.energy.connectivity import Topology
from sim.energy.network_arrays import Kinematics
from sim.energy.system import System, kinematics_of, system_of
from sim.structure import ConcreteParameters, VoidAngleContact


class Observables(NamedTuple):
    """Holds what follows from each state besides its motion.

    Attributes:
        strain_energy, contact_energy: (n_states,) N mm.
        reaction: (n_states, n_units, 3) elastic and contact force on the held dofs, N and N mm; NaN
            on free ones.
        void_angle: (n_states,) smallest void angle, rad.
        contact_pairs: (n_states,) pairs of units in contact: with a void closed below the cutoff
            angle or, by the law of distance, nearer than the activation distance.
        stretch: (n_states,) largest elongation or shortening of a ligament over its length.
        shear, bend: (n_states,) largest shear angle and relative rotation, rad.
    """

    strain_energy: Floats
    contact_energy: Floats
    reaction: Floats
    void_angle: Floats
    contact_pairs: Ints
    stretch: Floats
    shear: Floats
    bend: Floats

    def force_on(self, units: Ints) -> Floats:
        """Sums the reactions on units to a force (n_states, 2), N; there is none on free dofs."""
        return np.asarray(np.nansum(self.reaction[:, units, :2], axis=1))


@compiled
def _visit(
    states: Floats, system: System, kinematics: Kinematics, energies: Floats, forces: Floats,
    strains: Floats, pairs: Ints, n_states: int = 0,
) -> None:  # fmt: skip
    """Fills energies (n_states, 2), gradients, largest strains (n_states, 3), pairs in contact."""


def observe(topology: Topology, values: ConcreteParameters, motion: Floats) -> Observables:
    """Computes observables of states ``motion`` (n_states, n_units, 3) of a structure."""
    topology = topology.unloaded
    states = np.ascontiguousarray(motion.reshape(len(motion), topology.n_dofs))
    energies, forces = np.empty((len(states), 2)), np.empty_like(states)
    strains = np.empty((len(states), 3))
    near = np.zeros(len(states), dtype=np.int64)
    system = system_of(topology, values)
    _visit(states, system, kinematics_of(system), energies, forces, strains, near)
    try:
        raise_new_pairs(system.contacts)
    except NewContactPairs as met:
        return observe(topology.coupling(met.pairs), values, motion)
    reaction = np.full_like(states, np.nan)
    reaction[:, topology.held] = forces[:, topology.held]
    law, voids = topology.contact, topology.smallest_void_angles(values.void, motion)
    return Observables(
        energies[:, 0],
        energies[:, 1],
        reaction.reshape(motion.shape),
        voids.min(axis=1, initial=np.pi),
        (voids < law.cutoff_angle).sum(axis=1) if isinstance(law, VoidAngleContact) else near,
        *strains.T,
    )
