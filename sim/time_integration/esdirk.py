"""Integrates a network's motion by diagonally implicit Runge-Kutta steps, compiled."""

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import System, Workspace, admissible_step, gradient
from sim.time_integration.esdirk_stage import CONVERGED, Base, solve_stage


@inlined
def _stage_base(
    s: int, h: float, stages: Floats, u: Floats, v: Floats, a: Floats, base: Base
) -> None:
    """Fills u* and v* of stage ``s`` from the stages (n_stages, n_dofs) before it."""
    base.u[:] = u[0]
    base.v[:] = v[0]
    for j in range(s):
        base.u[:] += h * stages[s, j] * v[j]
        base.v[:] += h * stages[s, j] * a[j]


@inlined
def _guess(
    s: int, h: float, nodes: Floats, u: Floats, v: Floats, a: Floats, base: Base, system: System,
    work: Workspace, motion: Floats,
) -> None:  # fmt: skip
    """Guess of a stage: the motion extrapolated over the step, for all dofs alike.

    The first stage goes on at the step's first acceleration, the others on the parabola through the
    two before them that starts at the step's first velocity: next to it, accelerations of stages
    extrapolate ten times worse, for stiff modes are in them.

    Held dofs are extrapolated too and moved to their values together with the others: a driven unit
    moved alone would make the tangent indefinite.
    """
    if s == 1:
        motion[:] = base.u + base.k * (base.v + base.k * a[0])
    else:
        t, t1, t2 = nodes[s], nodes[s - 2], nodes[s - 1]
        w = (t**2 - t2**2) / (t2**2 - t1**2)
        motion[:] = u[s - 1] + w * (u[s - 1] - u[s - 2]) + h * (t - t2 - w * (t2 - t1)) * v[0]
    work.step[:] = motion - u[s - 1]
    if admissible_step(u[s - 1], system, work.step) <= 1.0:
        motion[:] = u[s - 1]


@inlined
def _start(drive: Floats, system: System, work: Workspace, u: Floats, v: Floats, a: Floats) -> None:
    """Puts the held dofs of the initial state in place and fills its acceleration."""
    for i in range(len(system.held)):
        u[system.held[i]] = drive[i]
    a[:] = 0.0
    gradient(u, system, work.kinematics, work.force)
    for d in system.dofs:  # M a = -dW/du - C v
        a[d] = -(work.force[d] + system.damping[d] * v[d]) / system.mass[d]


@inlined
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
    first: int,
    drive: Floats,
    system: System,
    work: Workspace,
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

    Returns:
        status, step index reached, dof with the largest step left.
    """
    n_steps, n_stages = len(times) - 1, len(nodes)
    motion = np.empty(len(system.mass))
    base_u, base_v = np.empty_like(motion), np.empty_like(motion)
    rate, factored_k = 0.1, -1.0
    fresh = factored_k > 0.0  # not the constant, for which the stage would be compiled once more
    if first == 0:
        _start(drive[0], system, work, u[0, 0], v[0, 0], a[0, 0])
    for n in range(first, n_steps):
        h = times[n + 1] - times[n]
        base = Base(base_u, base_v, h * stages[1, 1])
        fresh = fresh and abs(base.k - factored_k) <= 1e-9 * base.k
        if not fresh:
            factored_k = base.k
        for s in range(1, n_stages):
            _stage_base(s, h, stages, u[n], v[n], a[n], base)
            _guess(s, h, nodes, u[n], v[n], a[n], base, system, work, motion)
            target = drive[n * (n_stages - 1) + s]
            status, fresh, rate = solve_stage(
                motion, target, base, tolerance * h, system, work, fresh, rate, counts
            )
            if status != CONVERGED:  # after a kink in the drive extrapolation leads astray
                motion[:] = base.u
                status, fresh, rate = solve_stage(
                    motion, target, base, tolerance * h, system, work, fresh, rate, counts
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
