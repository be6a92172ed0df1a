"""Sums the energy of a system: its ligaments, contact by the law of its structure, and dead loads.

A load q on a degree of freedom u adds -q u. It is a prescribed coordinate of the motion like a held
displacement, so that solvers follow it, and adjoints differentiate by it, as they do by that one.

The solvers see the energy and the admissible states through these functions alone. Second
derivatives read the kinematics that `gradient` or `locate` left of the same state.
"""

from sim.core import Floats, Ints, call_at, compiled
from sim.energy import ligament_kernels, void_contact_kernels
from sim.energy.contact_calls import FREE_STEP, GRADIENT, HESSIAN_PRODUCT, MIXED, TANGENT
from sim.energy.network_arrays import Kinematics, Sensitivity
from sim.energy.system import System
from sim.linalg import Matrix


@compiled
def locate(motion: Floats, system: System, kinematics: Kinematics) -> None:
    """Fills the kinematics of a state, as the second derivatives read them."""
    ligament_kernels.locate(motion, system.net, kinematics)


@compiled
def gradient(
    motion: Floats, system: System, kinematics: Kinematics, out: Floats
) -> tuple[float, float]:
    """Fills the energy gradient ``out`` (n_dofs,), and the kinematics.

    The work of the loads is taken from the strain energy; the gradient by them is left at zero.

    Returns:
        strain and contact energy, N mm; the latter is infinite in a state that is not admissible.
    """
    strain = ligament_kernels.gradient(motion, system.net, kinematics, out)
    contact = void_contact_kernels.add_gradient(motion, system.net, out)
    if len(system.contacts.pairs) > 0:
        contact += call_at(system.calls[GRADIENT], 0.0, (motion, system.contacts, out))
    first = len(out) - 3 * len(system.loaded)
    for k in range(len(system.loaded)):
        for m in range(3):
            d, load = 3 * system.loaded[k] + m, motion[first + 3 * k + m]
            out[d] -= load
            strain -= load * motion[d]
    return strain, contact


@compiled
def tangent(motion: Floats, system: System, kinematics: Kinematics, matrix: Matrix) -> None:
    """Adds the energy's Hessian among the free dofs to a matrix."""
    ligament_kernels.tangent(motion, system.net, kinematics, system.entries, matrix.values)
    void_contact_kernels.add_tangent(motion, system.net, system.free, matrix)
    if len(system.contacts.pairs) > 0:
        given = (motion, system.contacts, system.free, matrix)
        call_at(system.calls[TANGENT], None, given)


@compiled
def hessian_product(
    motion: Floats, system: System, kinematics: Kinematics, direction: Floats, out: Floats
) -> None:
    """Fills ``out`` (n_dofs,) with the Hessian times ``direction``, over all dofs."""
    ligament_kernels.hessian_product(motion, system.net, kinematics, direction, out)
    void_contact_kernels.add_hessian_product(motion, system.net, direction, out)
    if len(system.contacts.pairs) > 0:
        given = (motion, system.contacts, direction, out)
        call_at(system.calls[HESSIAN_PRODUCT], None, given)
    first = len(out) - 3 * len(system.loaded)
    for k in range(len(system.loaded)):
        for m in range(3):
            d, load = 3 * system.loaded[k] + m, first + 3 * k + m
            out[d] -= direction[load]
            out[load] -= direction[d]


@compiled
def mixed(
    motion: Floats, system: System, kinematics: Kinematics, direction: Floats, which: Ints,
    out: Sensitivity,
) -> None:  # fmt: skip
    """Adds d/dp of (``direction`` . dE/dmotion), of the ligaments' own p only for ``which``."""
    ligament_kernels.mixed(motion, system.net, kinematics, direction, which, out)
    void_contact_kernels.add_mixed(motion, system.net, direction, which, out)
    if len(system.contacts.pairs) > 0:
        given = (motion, system.contacts, kinematics.turn, direction, out)
        call_at(system.calls[MIXED], None, given)


@compiled
def admissible_step(motion: Floats, system: System, step: Floats) -> float:
    """Largest multiple of ``step`` (n_dofs,) up to which all states are admissible."""
    largest = void_contact_kernels.barrier_step(motion, system.net, step)
    if len(system.contacts.pairs) > 0:
        free = call_at(system.calls[FREE_STEP], 0.0, (motion, system.contacts, step))
        largest = min(largest, free)
    return largest
