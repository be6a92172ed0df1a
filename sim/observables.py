"""Energies and reactions of given states."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.arrays import Floats
from sim.kernels import compiled
from sim.model import Topology, Values
from sim.potential import gradient
from sim.system import System, system_of


class Observables(NamedTuple):
    """What is known of each state besides its motion.

    Attributes:
        strain_energy, contact_energy: (n_states,) N mm.
        reaction: (n_states, n_units, 3) elastic and contact force on the held dofs, N and N mm; NaN
            on free ones.
        void_angle: (n_states,) smallest void angle, rad.
    """

    strain_energy: Floats
    contact_energy: Floats
    reaction: Floats
    void_angle: Floats


@compiled
def _visit(states: Floats, system: System, energies: Floats, forces: Floats) -> None:
    turn = np.empty((states.shape[1] // 3, 4))
    for n in range(len(states)):
        energies[n] = gradient(states[n], system, turn, forces[n])


def observe(topology: Topology, values: Values, motion: Floats) -> Observables:
    """Observables of states ``motion`` (n_states, n_units, 3) of a structure."""
    states = np.ascontiguousarray(motion.reshape(len(motion), topology.n_dofs))
    energies, forces = np.empty((len(states), 2)), np.empty_like(states)
    _visit(states, system_of(topology, values), energies, forces)
    reaction = np.full_like(states, np.nan)
    reaction[:, topology.held] = forces[:, topology.held]
    return Observables(
        energies[:, 0],
        energies[:, 1],
        reaction.reshape(motion.shape),
        topology.smallest_void_angle(values.void, motion),
    )
