"""Solves an implicit stage of a network's motion by Newton's method, compiled.

Equation: M q'' = -dE/dq - C q' on the free dofs, the held ones prescribed. A stage solves

    M (u - u* - k v*) / k^2 + C (u - u*) / k + dE/du = 0,   k = gamma h,

for its displacement u; then v = (u - u*) / k and a = (v - v*) / k. The factor is kept while it
contracts fast.
"""

from typing import NamedTuple

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import (
    System,
    Workspace,
    admissible_step,
    gradient,
    hessian_product,
    tangent,
)
from sim.linalg import add, clear, factorise, solve

MAX_ITERATIONS = 30
MAX_FACTORS = 20
PATIENCE = 6
"""Iterations that take as long as a factor and the two or three after it."""
KEEP_BELOW = 0.1
"""Rate of a stage up to which its factor is kept for the next."""
NEW_RATE = 0.3
"""At which a new factor is presumed to contract at most, until it is seen."""
KEEP_FROM_BARRIER = 0.9
MEMORY = 0.5
"""Most that the rate may fall from one iteration to the next: one that gets rid of what contracts
fast looks better than the iterations after it, which are left with the rest."""

CONVERGED, STALLED, INDEFINITE = 0, 1, 2


class Base(NamedTuple):
    """Holds what a stage starts from: u* and v* (n_dofs,), and k = gamma h."""

    u: Floats
    v: Floats
    k: float


@compiled
def factorise_stage(motion: Floats, system: System, work: Workspace, k: float) -> bool:
    """Factor of a stage's tangent M/k^2 + C/k + K in the workspace; False if not positive.

    The workspace has the kinematics of ``motion``.
    """
    clear(work.matrix)
    tangent(motion, system, work.kinematics, work.matrix)
    for i in range(len(system.dofs)):
        d = system.dofs[i]
        add(work.matrix, i, i, (system.mass[d] / k + system.damping[d]) / k)
    return factorise(work.matrix)


@inlined
def _newton_step(
    motion: Floats, target: Floats, base: Base, system: System, work: Workspace
) -> tuple[float, float]:
    """Fills ``work.step``: the held dofs to ``target``, the free ones by Newton's method.

    The workspace has the force at ``motion``, its kinematics and a factor.

    Returns:
        the largest move of a held dof and the (scaled) largest of a free one.
    """
    gap = 0.0
    work.step[:] = 0.0
    for i in range(len(system.held)):
        d = system.held[i]
        work.step[d] = target[i] - motion[d]
        gap = max(gap, abs(work.step[d]))
    if gap > 0.0:
        hessian_product(motion, system, work.kinematics, work.step, work.product)
        for d in system.dofs:
            work.force[d] += work.product[d]
    for i in range(len(system.dofs)):
        d = system.dofs[i]
        # residual M (v - v*) / k + C v + dW/du with v = (u - u*) / k
        velocity = (motion[d] - base.u[d]) / base.k
        inertia = system.mass[d] * (velocity - base.v[d]) / base.k
        work.right[i] = -(inertia + system.damping[d] * velocity + work.force[d])
    solve(work.matrix, work.right)
    size = 0.0
    for i in range(len(system.dofs)):
        d = system.dofs[i]
        work.step[d] = work.right[i]
        size = max(size, abs(work.right[i]) * system.scale[d])
    return gap, size


@compiled
def solve_stage(
    motion: Floats,
    target: Floats,
    base: Base,
    tolerance: float,
    system: System,
    work: Workspace,
    fresh: bool,
    rate: float,
    counts: Ints,
) -> tuple[int, bool, float]:
    """Newton iteration of one stage from the guess in ``motion``.

    Returns:
        the status, whether the factor in the workspace is still good, and the contraction rate.
    """
    previous, factors = 0.0, 0
    for _ in range(MAX_ITERATIONS):
        gradient(motion, system, work.kinematics, work.force)
        counts[0] += 1
        if not fresh:
            factors += 1
            counts[1] += 1
            if factors > MAX_FACTORS:
                return STALLED, False, 1.0
            if not factorise_stage(motion, system, work, base.k):
                return INDEFINITE, False, 1.0
            fresh, previous, rate = True, 0.0, min(rate, NEW_RATE)
        gap, size = _newton_step(motion, target, base, system, work)
        counts[2] += 1
        allowed = KEEP_FROM_BARRIER * admissible_step(motion, system, work.step)
        motion += min(1.0, allowed) * work.step
        if not size < 1e6:
            return STALLED, False, 1.0
        if allowed < 1.0:
            fresh = False
            continue
        if previous > 0.0:
            rate = max(size / previous, MEMORY * rate)
        likely = min(rate, 0.9)
        settled = likely / (1.0 - likely) * size <= tolerance or size <= 1e-13
        if gap == 0.0 and settled:
            return CONVERGED, rate < KEEP_BELOW, rate
        if previous > 0.0 and rate**PATIENCE * size > tolerance:
            fresh = False
        previous = size
    return STALLED, False, rate
