"""Sweeps back through an implicit integration: the derivative of the steps taken, compiled.

It factors every stage's tangent anew, so that it does not depend on which factors were kept.
"""

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import Bars, System, Workspace, hessian_product, locate, mixed
from sim.linalg import solve
from sim.time_integration.esdirk_stage import factorise_stage


@inlined
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
    """Adds what the balance of one state contributes.

    The workspace holds its multiplier (``right``) and its kinematics.
    """
    work.step[:] = 0.0
    for i in range(len(system.dofs)):
        d = system.dofs[i]
        work.step[d] = -work.right[i]
        bars.mass[d] -= work.right[i] * acceleration[d]
        bars.damping[d] -= work.right[i] * velocity[d]
    mixed(motion, system, work.kinematics, work.step, which, bars.sensitivity)
    hessian_product(motion, system, work.kinematics, work.step, work.product)
    for i in range(len(system.held)):
        drive[i] += work.product[system.held[i]]


@inlined
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
    work: Workspace,
    stages: Floats,
    which: Ints,
    bars: Bars,
) -> bool:
    """Reverse sweep of ``sim.time_integration.esdirk.march``, of its grid and stages.

    `bar_u`, `bar_v` (n_steps + 1, n_dofs) are loss derivatives by displacement and velocity at the
    grid points; `which` are ligaments whose parameters are differentiated by; `bars` is added to.

    Returns:
        False if a stage's tangent is not positive definite.
    """
    n_steps, n_stages = len(times) - 1, stages.shape[0]
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
                # (M / k^2 + C / k + K) lambda = du + dv / k + da / k^2
                work.right[i] = u[s, d] + (v[s, d] + a[s, d] / k) / k
            locate(stage_u[n, s], system, work.kinematics)
            if not factorise_stage(stage_u[n, s], system, work, k):
                return False
            solve(work.matrix, work.right)
            drive = bars.drive[n * (n_stages - 1) + s]
            _gather(stage_u[n, s], stage_v[n, s], stage_a[n, s], system, work, which, bars, drive)
            _stage_back(s, h, stages, system, work, v, a, next_u, next_v)
        next_v += v[0]
        next_a += a[0]
    for i in range(len(system.dofs)):
        work.right[i] = next_a[system.dofs[i]] / system.mass[system.dofs[i]]
    locate(stage_u[0, 0], system, work.kinematics)
    _gather(stage_u[0, 0], stage_v[0, 0], stage_a[0, 0], system, work, which, bars, bars.drive[0])
    return True
