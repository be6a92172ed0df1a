"""Computes the smallest eigenvalue of the tangent at an equilibrium, and its derivatives.

It vanishes where a stable path ends. With K v = lambda S^2 v and v . S^2 v = 1,

    dlambda = v . dK v,

of which the part by the state goes on to the parameters through the equilibrium, by the adjoint.
"""

import numpy as np
import scipy.sparse.linalg as spla

from sim.collision import raise_new_pairs
from sim.core import Floats, NewContactPairs, SimulationError
from sim.energy import (
    Bars,
    System,
    Topology,
    as_values,
    empty_bars,
    hessian_product,
    kinematics_of,
    locate,
    mixed,
    system_of,
    workspace,
)
from sim.linalg import solve
from sim.quasistatics.equilibrium_path import adjoint
from sim.quasistatics.newton import factorise_tangent
from sim.structure import ConcreteParameters

STEP = 1e-3
"""Of the differences along the mode, mm."""
STENCIL = ((-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0))
"""Places and weights of a first derivative of order 4."""


def lowest_eigenpair(system: System, state: Floats) -> tuple[float, Floats]:
    """Finds the smallest eigenvalue (N/mm) of the tangent, and its mode (n_dofs,), by Lanczos.

    `state` (n_dofs,) is a stable equilibrium; the system's scale makes rotations lengths.

    Raises:
        NewContactPairs: units are near whose coupling the tangent has no room for.
        SimulationError: the state is not stable.
    """
    work, scale = workspace(system), system.scale[system.dofs]
    stable = factorise_tangent(state, system, work, 0.0, np.zeros(4, dtype=np.int64))
    raise_new_pairs(system.contacts)
    if not stable:
        raise SimulationError("an equilibrium is not a minimum of the energy")

    def product(x: Floats) -> Floats:
        right = np.ravel(x) * scale
        solve(work.matrix, right)
        return right * scale

    operator = spla.LinearOperator((len(scale),) * 2, matvec=product, dtype=float)
    start = np.random.default_rng(0).normal(size=len(scale))
    inverse, found = spla.eigsh(operator, k=1, which="LA", v0=start)
    mode = np.zeros_like(state)
    mode[system.dofs] = found[:, 0] / scale
    return float(1.0 / inverse[0]), mode


def eigenvalue_and_slopes(
    topology: Topology, values: ConcreteParameters, state: Floats
) -> tuple[float, ConcreteParameters]:
    """Computes the smallest eigenvalue at an equilibrium, and its derivatives by all parameters.

    `state` (n_dofs,) is a stable equilibrium.

    Raises:
        SimulationError: the state is not stable.
    """
    try:
        return _value_and_slopes(topology, values, state)
    except NewContactPairs as met:
        return eigenvalue_and_slopes(topology.coupling(met.pairs), values, state)


def _value_and_slopes(
    topology: Topology, values: ConcreteParameters, state: Floats
) -> tuple[float, ConcreteParameters]:
    system = system_of(topology, values)
    value, mode = lowest_eigenpair(system, state)
    bars, bar = mode_slopes(topology, system, state, mode)
    adjoint(state[None], bar[None], system, workspace(system), topology.designed, bars)
    raise_new_pairs(system.contacts)
    return value, as_values(bars, topology.n_units)


def mode_slopes(
    topology: Topology, system: System, state: Floats, mode: Floats
) -> tuple[Bars, Floats]:
    """Differentiates v . K v, with the mode v (n_dofs,) held, by parameters and state (n_dofs,)."""
    bars, bar = empty_bars(system, (1, len(system.held))), np.zeros_like(state)
    kinematics, product = kinematics_of(system), np.empty_like(state)
    for place, weight in STENCIL:  # v . dK v is the derivative of d(v . dE/du) along v
        moved, direction = state + place * STEP * mode, weight / STEP * mode
        locate(moved, system, kinematics)
        mixed(moved, system, kinematics, direction, topology.designed, bars.sensitivity)
        hessian_product(moved, system, kinematics, direction, product)
        bar += product
    return bars, bar
