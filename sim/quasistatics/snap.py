"""Leaves a limit point or a branching as damped motion does."""

from sim.core import Floats, Ints, compiled
from sim.energy import System, Workspace


@compiled
def relax(
    motion: Floats, drag: Floats, relative: float, absolute: float, system: System,
    work: Workspace, counts: Ints,
) -> bool:  # fmt: skip
    """Follows the damped motion from ``motion`` at fixed held dofs to its rest, a minimum.

    `motion` (n_dofs,) is moved; `drag` (n_dofs,) is C, the viscous damping, its unit of no account.
    The residual at rest is `relative` to the largest reaction, its floor `absolute` in N. The
    workspace is overwritten but for ``saved``, and holds a factor of the tangent at rest after it.
    """
