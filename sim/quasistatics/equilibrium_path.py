"""Follows equilibrium paths by Newton continuation, with their exact adjoint."""

from typing import NamedTuple

from sim.core import Floats, Ints, compiled
from sim.energy import Bars, System, Workspace

MOST_SNAPS = 64
"""Snaps of a path that are recorded."""


class Branch(NamedTuple):
    """Holds the equilibria at all loads."""

    states: Floats  # (n_loads, n_dofs)
    tangents: Floats  # (n_loads, n_dofs) step to each along the path's tangent at the one before
    stable: Ints  # (n_loads,) whether each is a minimum of the energy
    # (n_loads,) whether the path ended on the way there, in a limit point or a branching, and went
    # on after a jump
    jumped: Ints
    snapped: Floats  # (n_loads,) part of the way from the load before at the last jump, or NaN
    # (MOST_SNAPS,) where the first of all did, in order: number of the load ahead, and the part of
    # the way to it; NaN behind them
    snaps: Floats
    eigenvalue: Floats  # (n_loads,) smallest of the tangent, rotations times scale, N/mm


@compiled
def follow(
    loads: Floats, known: int, progress: Floats, bends: Floats, trusted: Ints, leaves: bool,
    sense: float, system: System, work: Workspace, relative: float, absolute: float, drag: Floats,
    branch: Branch, counts: Ints, n_loads: int = 0,
) -> tuple[int, float]:  # fmt: skip
    """Fills a branch with the equilibria at ``loads`` (n_loads, n_held), the first `known` kept.

    `progress` (4,), see ``quasistatics.h``, is that with which these were found. `bends` (n_loads,
    n_dofs) is by how much the path of a similar structure departs from its tangent between two
    loads, to be tried first where `trusted` (n_loads,). Where the path ends, the structure `leaves`
    it, or the branch ends as well. The critical mode of a branching is followed in the `sense` 1 or
    -1. `work` is room for the states. The residual's tolerance is relative to the largest reaction,
    its floor `absolute` in N; `drag` (n_dofs,) is that of the damped motion after a snap; `counts`
    (4,) gathers the work.

    Returns:
        the number of loads reached, and the fraction of the way to the next.
    """


@compiled
def adjoint(
    states: Floats,
    bar: Floats,
    system: System,
    work: Workspace,
    which: Ints,
    bars: Bars,
    n_states: int = 0,
    n_which: int = 0,
) -> int:
    """Adds the derivatives of a loss with derivatives ``bar`` (n_loads, n_dofs) by ``states``.

    Returns:
        the first load whose tangent is not positive definite, or -1.
    """
