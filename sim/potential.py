"""The whole energy of a system: its ligaments, and contact by the law of its structure.

The solvers see the energy and the admissible states through these functions alone.
"""

from __future__ import annotations

from sim import kernels
from sim.arrays import Floats, Ints
from sim.compiling import compiled
from sim.kernels import Sensitivity
from sim.matrix import Matrix
from sim.system import System


@compiled
def gradient(motion: Floats, system: System, turn: Floats, out: Floats) -> tuple[float, float]:
    """Fills the energy gradient ``out`` (n_dofs,); returns strain and contact energy, N mm.

    The contact energy of a state that is not admissible is infinite.
    """
    return kernels.gradient(motion, system.net, turn, out)


@compiled
def tangent(motion: Floats, system: System, turn: Floats, matrix: Matrix) -> None:
    """Adds the energy's Hessian among the free dofs to a matrix."""
    kernels.tangent(motion, system.net, turn, system.free, matrix)


@compiled
def hessian_product(
    motion: Floats, system: System, turn: Floats, direction: Floats, out: Floats
) -> None:
    """Fills ``out`` (n_dofs,) with the Hessian times ``direction``, over all dofs."""
    kernels.hessian_product(motion, system.net, turn, direction, out)


@compiled
def mixed(
    motion: Floats, system: System, turn: Floats, direction: Floats, which: Ints, out: Sensitivity
) -> None:
    """Adds d/dp of (``direction`` . dE/dmotion), of the ligaments' own p only for ``which``."""
    kernels.mixed(motion, system.net, turn, direction, which, out)


@compiled
def admissible_step(motion: Floats, system: System, step: Floats) -> float:
    """Largest multiple of ``step`` (n_dofs,) up to which all states are admissible."""
    return kernels.barrier_step(motion, system.net, step)
