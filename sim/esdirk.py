"""Compiled implicit integration of a network's motion and its exact discrete adjoint.

Equation: M q'' = -dE/dq - C q' on the free dofs, the held ones prescribed. Each implicit stage
solves

    M (u - u* - k v*) / k^2 + C (u - u*) / k + dE/du = 0,   k = gamma h,

for its displacement u by Newton's method; then v = (u - u*) / k and a = (v - v*) / k. The factor is
kept while it contracts. The adjoint refactors at every stage, so that it is the derivative of the
steps taken.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.arrays import Floats, Ints
from sim.compiling import compiled
from sim.matrix import add, clear, factorise, solve
from sim.potential import admissible_step, gradient, hessian_product, mixed, tangent
from sim.system import Bars, System, Workspace, workspace

MAX_ITERATIONS = 30
MAX_FACTORS = 12
REFACTOR_ABOVE = 0.3
KEEP_FROM_BARRIER = 0.9

CONVERGED, STALLED, INDEFINITE = 0, 1, 2


class Base(NamedTuple):
    """What a stage starts from: u* and v* (n_dofs,), and k = gamma h."""

    u: Floats
    v: Floats
    k: float


@compiled
def _factorise_stage(motion: Floats, system: System, work: Workspace, k: float) -> bool:
    """Factor of a stage's tangent M/k^2 + C/k + K in the workspace; False if not positive."""
    clear(work.matrix)
    tangent(motion, system, work.turn, work.matrix)
    for i in range(len(system.dofs)):
        d = system.dofs[i]
        add(work.matrix, i, i, (system.mass[d] / k + system.damping[d]) / k)
    return factorise(work.matrix)


@compiled
def _newton_step(
    motion: Floats, target: Floats, base: Base, system: System, work: Workspace
) -> tuple[float, float]:
    """Fills ``work.step``: the held dofs to ``target``, the free ones by Newton's method.

    Returns:
        the largest move of a held dof and the (scaled) largest of a free one.
    """
    gradient(motion, system, work.turn, work.force)
    gap = 0.0
    work.step[:] = 0.0
    for i in range(len(system.held)):
        d = system.held[i]
        work.step[d] = target[i] - motion[d]
        gap = max(gap, abs(work.step[d]))
    if gap > 0.0:
        hessian_product(motion, system, work.turn, work.step, work.product)
        for d in system.dofs:
            work.force[d] += work.product[d]
    for i in range(len(system.dofs)):
        d = system.dofs[i]
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
def _solve_stage(
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
    for iteration in range(MAX_ITERATIONS):
        if not fresh:
            factors += 1
            counts[1] += 1
            if factors > MAX_FACTORS:
                return STALLED, False, 1.0
            if not _factorise_stage(motion, system, work, base.k):
                return INDEFINITE, False, 1.0
            fresh, previous = True, 0.0
        gap, size = _newton_step(motion, target, base, system, work)
        counts[0] += 1
        counts[2] += 1
        allowed = KEEP_FROM_BARRIER * admissible_step(motion, system, work.step)
        motion += min(1.0, allowed) * work.step
        if not size < 1e6:
            return STALLED, False, 1.0
        if allowed < 1.0:
            fresh = False
            continue
        if previous > 0.0:
            rate = size / previous
        likely = min(rate, 0.9)
        settled = likely / (1.0 - likely) * size <= tolerance or size <= 1e-13
        if gap == 0.0 and settled:
            return CONVERGED, rate < REFACTOR_ABOVE, rate
        too_slow = rate ** (MAX_ITERATIONS - iteration) * size > tolerance
        if previous > 0.0 and (rate > REFACTOR_ABOVE or too_slow):
            fresh = False
        previous = size
    return STALLED, False, rate


@compiled
def _stage_base(
    s: int, h: float, stages: Floats, u: Floats, v: Floats, a: Floats, base: Base
) -> None:
    """Fills u* and v* of stage ``s`` from the stages (n_stages, n_dofs) before it."""
    base.u[:] = u[0]
    base.v[:] = v[0]
    for j in range(s):
        base.u[:] += h * stages[s, j] * v[j]
        base.v[:] += h * stages[s, j] * a[j]


@compiled
def _guess(
    s: int, nodes: Floats, u: Floats, a: Floats, base: Base, system: System, work: Workspace,
    motion: Floats,
) -> None:  # fmt: skip
    """Guess of a stage: the acceleration extrapolated over the last stages, for all dofs alike.

    Held dofs are extrapolated too and moved to their values together with the others: a driven unit
    moved alone would make the tangent indefinite.
    """
    if s == 1:
        motion[:] = base.u + base.k * (base.v + base.k * a[0])
    else:
        w = (nodes[s] - nodes[s - 2]) / (nodes[s - 1] - nodes[s - 2])
        motion[:] = base.u + base.k * (base.v + base.k * (w * a[s - 1] + (1.0 - w) * a[s - 2]))
    work.step[:] = motion - u[s - 1]
    if admissible_step(u[s - 1], system, work.step) <= 1.0:
        motion[:] = u[s - 1]


@compiled
def _start(drive: Floats, system: System, work: Workspace, u: Floats, v: Floats, a: Floats) -> None:
    """Puts the held dofs of the initial state in place and fills its acceleration."""
    for i in range(len(system.held)):
        u[system.held[i]] = drive[i]
    a[:] = 0.0
    gradient(u, system, work.turn, work.force)
    for d in system.dofs:
        a[d] = -(work.force[d] + system.damping[d] * v[d]) / system.mass[d]


@compiled
def _worst(system: System, step: Floats) -> int:
    """Free dof with the largest (scaled) step."""
    worst = system.dofs[0]
    for d in system.dofs:
        if abs(step[d]) * system.scale[d] > abs(step[worst]) * system.scale[worst]:
            worst = d
    return worst


@compiled
def march(
    times: Floats,
    drive: Floats,
    system: System,
    stages: Floats,
    nodes: Floats,
    tolerance: float,
    u: Floats,
    v: Floats,
    a: Floats,
    counts: Ints,
) -> tuple[int, int, int]:
    """Integrates over the fixed grid ``times``.

    Args:
        times: (n_steps + 1,) s.
        drive: (1 + n_steps (n_stages - 1), n_held) prescribed values at the start and all stages.
        system: the structure.
        stages: coefficients of the method.
        nodes: its stage times.
        tolerance: of the stage velocity, mm/s.
        u: (n_steps + 1, n_stages, n_dofs) displacement of all stages; row n holds those of step n,
            the last row only the end state in its first. Its first entry is the initial state.
        v: velocity, likewise.
        a: acceleration, likewise; filled throughout.
        counts: (3,) gathers gradients, factorisations and solves.

    Returns:
        status, step index reached, dof with the largest step left.
    """
    n_steps, n_stages = len(times) - 1, len(nodes)
    work = workspace(system)
    motion = np.empty(len(system.mass))
    base_u, base_v = np.empty_like(motion), np.empty_like(motion)
    fresh, rate, factored_k = False, 0.1, -1.0
    _start(drive[0], system, work, u[0, 0], v[0, 0], a[0, 0])
    for n in range(n_steps):
        h = times[n + 1] - times[n]
        base = Base(base_u, base_v, h * stages[1, 1])
        if abs(base.k - factored_k) > 1e-9 * base.k:
            fresh, factored_k = False, base.k
        for s in range(1, n_stages):
            _stage_base(s, h, stages, u[n], v[n], a[n], base)
            _guess(s, nodes, u[n], a[n], base, system, work, motion)
            target = drive[n * (n_stages - 1) + s]
            status, fresh, rate = _solve_stage(
                motion, target, base, tolerance * h, system, work, fresh, rate, counts
            )
            if status != CONVERGED:  # after a kink in the drive the extrapolation leads astray
                motion[:] = u[n, s - 1]
                status, fresh, rate = _solve_stage(
                    motion, target, base, tolerance * h, system, work, False, rate, counts
                )
            if status != CONVERGED:
                return status, n, _worst(system, work.step)
            u[n, s] = motion
            v[n, s] = (motion - base.u) / base.k
            a[n, s] = (v[n, s] - base.v) / base.k
        u[n + 1, 0] = u[n, n_stages - 1]
        v[n + 1, 0] = v[n, n_stages - 1]
        a[n + 1, 0] = a[n, n_stages - 1]
    return CONVERGED, n_steps, 0


@compiled
def _gather(
    motion: Floats,
    velocity: Floats,
    acceleration: Floats,
    system: System,
    work: Workspace,
    which: Ints,
    bars: Bars,
    drive: Floats,
) -> None:
    """Adds what the balance of one state contributes; ``work.right`` holds its multiplier."""
    work.step[:] = 0.0
    for i in range(len(system.dofs)):
        d = system.dofs[i]
        work.step[d] = -work.right[i]
        bars.mass[d] -= work.right[i] * acceleration[d]
        bars.damping[d] -= work.right[i] * velocity[d]
    mixed(motion, system, work.turn, work.step, which, bars.sensitivity)
    hessian_product(motion, system, work.turn, work.step, work.product)
    for i in range(len(system.held)):
        drive[i] += work.product[system.held[i]]


@compiled
def _stage_back(
    s: int, h: float, stages: Floats, system: System, work: Workspace, v: Floats, a: Floats,
    next_u: Floats, next_v: Floats,
) -> None:  # fmt: skip
    """Passes the derivatives of stage ``s`` to the step's start and to the stages before it.

    ``v``, ``a`` (n_stages, n_dofs) are the derivatives by the stages, ``next_u``, ``next_v``
    (n_dofs,) those by the step's start; ``work.right`` holds the stage's multiplier.
    """
    k = h * stages[s, s]
    for i in range(len(system.dofs)):
        d = system.dofs[i]
        multiplier = work.right[i]
        inertia = system.mass[d] / k
        base_v = inertia * multiplier - a[s, d] / k
        base_u = (inertia + system.damping[d]) / k * multiplier - (v[s, d] + a[s, d] / k) / k
        next_u[d] += base_u
        next_v[d] += base_v
        for j in range(s):
            v[j, d] += h * stages[s, j] * base_u
            a[j, d] += h * stages[s, j] * base_v


@compiled
def adjoint(
    times: Floats,
    stage_u: Floats,
    stage_v: Floats,
    stage_a: Floats,
    bar_u: Floats,
    bar_v: Floats,
    system: System,
    stages: Floats,
    which: Ints,
    bars: Bars,
) -> bool:
    """Reverse sweep of ``march``.

    Args:
        times: its grid.
        stage_u: its displacements.
        stage_v: its velocities.
        stage_a: its accelerations.
        bar_u: (n_steps + 1, n_dofs) loss derivatives by the displacement at the grid points.
        bar_v: the same by the velocity.
        system: the structure.
        stages: coefficients of the method.
        which: ligaments whose parameters are differentiated by.
        bars: added to.

    Returns:
        False if a stage's tangent is not positive definite.
    """
    n_steps, n_stages = len(times) - 1, stages.shape[0]
    work = workspace(system)
    u = np.zeros((n_stages, len(system.mass)))
    v, a = np.zeros_like(u), np.zeros_like(u)
    next_u, next_v = bar_u[n_steps].copy(), bar_v[n_steps].copy()
    next_a = np.zeros_like(next_u)
    for n in range(n_steps - 1, -1, -1):
        h = times[n + 1] - times[n]
        for bar, start in ((u, next_u), (v, next_v), (a, next_a)):
            bar[:] = 0.0
            bar[n_stages - 1] = start
        next_u[:] = bar_u[n]
        next_v[:] = bar_v[n]
        next_a[:] = 0.0
        for s in range(n_stages - 1, 0, -1):
            k = h * stages[s, s]
            for i in range(len(system.dofs)):
                d = system.dofs[i]
                work.right[i] = u[s, d] + (v[s, d] + a[s, d] / k) / k
            if not _factorise_stage(stage_u[n, s], system, work, k):
                return False
            solve(work.matrix, work.right)
            drive = bars.drive[n * (n_stages - 1) + s]
            _gather(stage_u[n, s], stage_v[n, s], stage_a[n, s], system, work, which, bars, drive)
            _stage_back(s, h, stages, system, work, v, a, next_u, next_v)
        next_v += v[0]
        next_a += a[0]
    for i in range(len(system.dofs)):
        work.right[i] = next_a[system.dofs[i]] / system.mass[system.dofs[i]]
    _gather(stage_u[0, 0], stage_v[0, 0], stage_a[0, 0], system, work, which, bars, bars.drive[0])
    return True
