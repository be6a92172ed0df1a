"""Factorises the tangent of a state, as Newton's method in ``newton.c`` does."""

from sim.core import Floats, Ints, compiled
from sim.energy import System, Workspace

GRADIENTS, FACTORS, SHIFTED, INCREMENTS = 0, 1, 2, 3
"""Places in the counts that the solvers gather."""


@compiled
def factorise_tangent(
    motion: Floats, system: System, work: Workspace, shift: float, counts: Ints
) -> bool:
    """Factorises the (shifted) tangent; False if it is not positive definite."""
