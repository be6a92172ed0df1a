"""Computes contact on the angle of the voids: energy, gradient, tangent, mixed derivatives."""

from sim.core import Floats, Ints, compiled
from sim.energy.network_arrays import NetworkArrays, Sensitivity
from sim.linalg import Matrix


@compiled
def void_slopes(net: NetworkArrays, k: int, side: int, turn: float) -> tuple[float, float, float]:
    """Computes one void's energy, infinite past the barrier, and two derivatives by the turn."""


@compiled
def add_gradient(motion: Floats, net: NetworkArrays, out: Floats) -> float:
    """Adds the gradient to ``out`` (3 n_units,); returns the contact energy, N mm."""


@compiled
def add_tangent(motion: Floats, net: NetworkArrays, free: Ints, matrix: Matrix) -> None:
    """Adds the Hessian among the free dofs to a matrix."""


@compiled
def add_hessian_product(motion: Floats, net: NetworkArrays, direction: Floats, out: Floats) -> None:
    """Adds the Hessian times ``direction`` to ``out`` (3 n_units,)."""


@compiled
def add_mixed(
    motion: Floats,
    net: NetworkArrays,
    direction: Floats,
    which: Ints,
    out: Sensitivity,
    n_which: int = 0,
) -> None:
    """Adds d/dp of (``direction`` . dE/dmotion) to ``out`` for the ligaments in ``which``."""


@compiled
def barrier_step(motion: Floats, net: NetworkArrays, step: Floats) -> float:
    """Finds the multiple of ``step`` (3 n_units,) at which a void reaches its barrier; exact."""
