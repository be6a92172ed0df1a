"""Integrates a network's motion by diagonally implicit Runge-Kutta steps."""

from sim.core import Floats, Ints, compiled
from sim.energy import System, Workspace


@compiled
def march(
    times: Floats, first: int, drive: Floats, system: System, work: Workspace, stages: Floats,
    nodes: Floats, tolerance: float, u: Floats, v: Floats, a: Floats, counts: Ints,
    n_times: int = 0, n_nodes: int = 0,
) -> tuple[int, int, int]:  # fmt: skip
    """Integrates over the fixed grid ``times``.

    Args:
        times: (n_steps + 1,) s.
        first: step to begin with; those before it are given.
        drive: (1 + n_steps (n_stages - 1), n_held) prescribed values at the start and all stages.
        system: the structure.
        work: room for its states, filled.
        stages: coefficients of the method.
        nodes: its stage times.
        tolerance: of the stage velocity, mm/s.
        u: (n_steps + 1, n_stages, n_dofs) displacement of all stages; row n holds those of step n,
            the last row only the end state in its first. Its first entry is the initial state.
        v: velocity, likewise.
        a: acceleration, likewise; filled throughout.
        counts: (3,) gathers gradients, factorisations and solves.
        n_times: left out.
        n_nodes: left out.

    Returns:
        status, step index reached, dof with the largest step left.
    """
