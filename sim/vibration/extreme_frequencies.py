"""Computes the highest and lowest eigenfrequency of a structure about a state."""

from collections.abc import Callable

import numpy as np
import scipy.sparse.linalg as spla

from sim.collision import raise_new_pairs
from sim.core import Floats, Ints
from sim.energy import Topology, hessian_product, kinematics_of, locate, system_of, tangent
from sim.linalg import clear, factorise, matrix, solve
from sim.structure import ConcreteParameters


def highest_frequency(
    topology: Topology,
    values: ConcreteParameters,
    motion: Floats | None = None,
    touching: Ints | None = None,
) -> float:
    """Finds the highest angular eigenfrequency (rad/s) about a state, by Lanczos iteration.

    The state is ``motion`` (n_units, 3), mm, mm, rad, by default rest; contact on void angles is
    that of the ligaments ``touching`` (default all).

    Raises:
        NewContactPairs: units are near whose coupling the topology has no room for.
    """
    system = system_of(topology, values, touching)
    state = np.zeros(topology.n_dofs) if motion is None else motion.ravel()
    kinematics = kinematics_of(system)
    locate(state, system, kinematics)
    free, root = topology.free_dofs, _root_mass(topology, values)

    def product(x: Floats) -> Floats:
        full, out = np.zeros(topology.n_dofs), np.empty(topology.n_dofs)
        full[free] = np.ravel(x) / root
        hessian_product(state, system, kinematics, full, out)
        return np.asarray(out[free] / root)

    square = _largest(product, topology.n_free, 1e-2)
    raise_new_pairs(system.contacts)
    return float(np.sqrt(abs(square)))


def lowest_frequency(topology: Topology, values: ConcreteParameters) -> float:
    """Finds the lowest angular eigenfrequency at rest, rad/s; zero if the rest is not stable.

    It is infinite where no dof is free.
    """
    if topology.n_free == 0:
        return float("inf")
    system = system_of(topology, values)
    made = matrix(system.pattern)
    clear(made)
    rest, kinematics = np.zeros(topology.n_dofs), kinematics_of(system)
    locate(rest, system, kinematics)
    tangent(rest, system, kinematics, made)
    if not factorise(made):
        return 0.0
    root = _root_mass(topology, values)

    def product(x: Floats) -> Floats:
        right = np.ravel(x) * root
        solve(made, right)
        return np.asarray(right * root)

    return float(1 / np.sqrt(_largest(product, topology.n_free, 1e-3)))


def _root_mass(topology: Topology, values: ConcreteParameters) -> Floats:
    return np.asarray(np.sqrt(values.mass.ravel()[topology.free_dofs]))


def _largest(product: Callable[[Floats], Floats], size: int, tolerance: float) -> float:
    """Finds the eigenvalue of largest magnitude of a symmetric operator."""
    if size == 0:
        return 0.0
    if size <= 2:
        return float(np.linalg.norm(np.stack([product(e) for e in np.eye(size)]), 2))
    operator = spla.LinearOperator((size, size), matvec=product, dtype=float)
    start = np.random.default_rng(0).normal(size=size)
    found = spla.eigsh(
        operator, k=1, which="LM", v0=start, tol=tolerance, return_eigenvectors=False
    )
    return float(found[0])
