"""Lays out a structure as compiled solvers take it, and their scratch memory."""

from typing import NamedTuple

import numpy as np

from sim.collision import ContactArrays, contact_arrays
from sim.core import Floats, Ints
from sim.energy.connectivity import Topology
from sim.energy.network_arrays import Kinematics, NetworkArrays, Sensitivity, no_sensitivity
from sim.linalg import Matrix, Pattern, matrix
from sim.structure import ConcreteParameters


class System(NamedTuple):
    """Holds one structure, its inertia and the numbering of its dofs."""

    net: NetworkArrays  # ligaments, and contact on their void angles
    contacts: ContactArrays  # contact on the distance of units
    mass: Floats  # (n_dofs,) diagonal
    damping: Floats  # (n_dofs,) diagonal
    free: Ints  # (n_dofs,) number of each dof among the free ones, negative where held
    dofs: Ints  # (n_free,) ids of the free dofs in the tangent's order
    held: Ints  # (n_held,) ids of the prescribed dofs, those of the loads last
    loaded: Ints  # (n_loaded,) units under dead loads, whose three components are the last dofs
    scale: Floats  # (n_dofs,) weights that make rotations comparable with displacements, mm
    pattern: Pattern  # of the tangent
    entries: Ints  # (n_ligaments, 21) where the ligaments' blocks lie in the tangent


class Workspace(NamedTuple):
    """Holds scratch arrays of a solve, overwritten at will."""

    kinematics: Kinematics  # of the state that the gradient was last computed at
    force: Floats  # (n_dofs,), as the next five
    step: Floats
    product: Floats
    trial: Floats
    saved: Floats
    guess: Floats
    right: Floats  # (n_free,)
    matrix: Matrix  # the tangent, then its factor


class Bars(NamedTuple):
    """Holds loss derivatives that a reverse sweep adds to."""

    sensitivity: Sensitivity  # by the network's parameters
    mass: Floats  # (n_dofs,)
    damping: Floats  # (n_dofs,)
    drive: Floats  # by the held values, shaped as the sweep takes them


def kinematics_of(system: System) -> Kinematics:
    """Allocates room for the kinematics of a state."""
    return Kinematics(np.empty((len(system.mass) // 3, 4)), np.empty(len(system.net.unit)))


def workspace(system: System, threads: int = 1) -> Workspace:
    """Allocates scratch arrays that fit a system, whose tangent that many threads factorise."""
    force, step, product, trial, saved, guess = np.empty((6, len(system.mass)))
    right = np.empty(len(system.dofs))
    return Workspace(
        kinematics_of(system), force, step, product, trial, saved, guess, right,
        matrix(system.pattern, threads),
    )  # fmt: skip


def system_of(
    topology: Topology, values: ConcreteParameters, touching: Ints | None = None
) -> System:
    """Lays out the system of parameters, with contact in ``touching`` ligaments (default all)."""
    free, pattern = topology.numbering
    loads = np.ones(3 * len(topology.loaded))  # of no mass that counts
    net = topology.network(values, touching)
    contacts = contact_arrays(topology.contact, values, topology.n_dofs // 3)
    return System(
        net=net,
        contacts=contacts,
        mass=np.concatenate([np.ravel(values.mass), loads]),
        damping=np.concatenate([np.ravel(values.damping), 0.0 * loads]),
        free=free,
        dofs=topology.free_dofs,
        held=topology.held,
        loaded=topology.loaded,
        scale=topology.scale,
        pattern=pattern,
        entries=topology.entries,
    )


def empty_bars(system: System, drive_shape: tuple[int, ...]) -> Bars:
    """Makes zeros to add derivatives to."""
    zero = np.zeros_like(system.mass)
    sensitivity = no_sensitivity(system.net, system.contacts)
    return Bars(sensitivity, zero, zero.copy(), np.zeros(drive_shape))


def as_values(bars: Bars, n_units: int) -> ConcreteParameters:
    """Shapes the derivatives by all parameters as they are, those of ``n_units`` units."""
    mass, damping = (part.reshape(-1, 3)[:n_units] for part in (bars.mass, bars.damping))
    return ConcreteParameters(*bars.sensitivity, mass=mass, damping=damping)
