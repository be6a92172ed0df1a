"""Sums the energy of a system: its ligaments, contact by the law of its structure, and dead loads.

A load q on a degree of freedom u adds -q u. It is a prescribed coordinate of the motion like a held
displacement, so that solvers follow it, and adjoints differentiate by it, as they do by that one.

The solvers see the energy and the admissible states through these functions alone. Second
derivatives read the kinematics that `gradient` or `locate` left of the same state.
"""

from sim.core import Floats, Ints, compiled
from sim.energy.network_arrays import Kinematics, Sensitivity
from sim.energy.system import System
from sim.linalg import Matrix


@compiled
def locate(motion: Floats, system: System, kinematics: Kinematics) -> None:
    """Fills the kinematics of a state, as the second derivatives read them."""


@compiled
def gradient(
    motion: Floats, system: System, kinematics: Kinematics, out: Floats
) -> tuple[float, float]:
    """Fills the energy gradient ``out`` (n_dofs,), and the kinematics.

    The work of the loads is taken from the strain energy; the gradient by them is left at zero.

    Returns:
        strain and contact energy, N mm; the latter is infinite in a state that is not admissible.
    """


@compiled
def tangent(motion: Floats, system: System, kinematics: Kinematics, matrix: Matrix) -> None:
    """Adds the energy's Hessian among the free dofs to a matrix."""


@compiled
def hessian_product(
    motion: Floats, system: System, kinematics: Kinematics, direction: Floats, out: Floats
) -> None:
    """Fills ``out`` (n_dofs,) with the Hessian times ``direction``, over all dofs."""


@compiled
def mixed(
    motion: Floats, system: System, kinematics: Kinematics, direction: Floats, which: Ints,
    out: Sensitivity, n_which: int = 0,
) -> None:  # fmt: skip
    """Adds d/dp of (``direction`` . dE/dmotion), of the ligaments' own p only for ``which``."""


@compiled
def admissible_step(motion: Floats, system: System, step: Floats) -> float:
    """Finds the largest multiple of ``step`` (n_dofs,) up to which all states are admissible."""
