"""Sweeps back through an implicit integration: the derivative of the steps taken."""

from sim.core import Floats, Ints, compiled
from sim.energy import Bars, System, Workspace


@compiled
def adjoint(
    times: Floats, stage_u: Floats, stage_v: Floats, stage_a: Floats, bar_u: Floats, bar_v: Floats,
    system: System, work: Workspace, stages: Floats, which: Ints, bars: Bars, n_times: int = 0,
    n_stages: int = 0, n_which: int = 0,
) -> bool:  # fmt: skip
    """Sweeps back through ``sim.time_integration.esdirk.march``, of its grid and stages.

    `bar_u`, `bar_v` (n_steps + 1, n_dofs) are loss derivatives by displacement and velocity at the
    grid points; `which` are ligaments whose parameters are differentiated by; `bars` is added to.

    Returns:
        False if a stage's tangent is not positive definite.
    """
