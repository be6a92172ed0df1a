"""Moves along an equilibrium path by one increment: its length, its steps, its departure."""

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import (
    System,
    Workspace,
    admissible_step,
    gradient,
    hessian_product,
    locate,
)
from sim.quasistatics.newton import KEEP_FROM_BARRIER, factorise_tangent, solve_free

SMALLEST_INCREMENT = 1e-8
"""Part of the way between two loads below which the path has ended."""
CROOKED, CROOKED_LENGTH = 0.05, 1e-5
"""Departure of a smooth increment from the trapezoidal rule at most, over its length and in mm."""
STEPS_AHEAD = 6
"""Newton steps at most by which an increment goes on where the barrier cuts its first step."""
STIFF_PART, SOFT_PART = 0.75, 0.5
"""Part of the way to where the eigenvalue is expected to vanish that an increment goes at most: of
a stiff structure, and of a soft one, as more of the path to a limit point is too crooked."""
SOFT = 0.5
"""Eigenvalue over the first state's up to which a structure is soft."""

INCREMENT, VALUE, RATE, FIRST = 0, 1, 2, 3
"""Places in the pace: part of the way to go next, smallest eigenvalue, rate of change of its square
over the length of the held dofs' way, and eigenvalue of the first state."""


@compiled
def tangent_step(motion: Floats, system: System, work: Workspace) -> None:
    """Fills ``work.step`` with that of the path for the held dofs' part in ``work.product``."""
    # K_ff du_f = -K_fh du_h
    locate(motion, system, work.kinematics)
    hessian_product(motion, system, work.kinematics, work.product, work.force)
    solve_free(system, work)
    for d in system.held:
        work.step[d] = work.product[d]


@inlined
def towards(motion: Floats, load: Floats, share: float, system: System, work: Workspace) -> None:
    """Fills ``work.product`` with a share of the held dofs' way to a load."""
    work.product[:] = 0.0
    for i in range(len(system.held)):
        d = system.held[i]
        work.product[d] = (load[i] - motion[d]) * share


@inlined
def length(step: Floats, dofs: Ints, system: System) -> float:
    """Norm of a step's dofs, mm."""
    total = 0.0
    for d in dofs:
        total += (step[d] * system.scale[d]) ** 2
    return np.sqrt(total)


@compiled
def crookedness(motion: Floats, predicted: Floats, system: System, work: Workspace) -> float:
    """Compares the way from ``work.saved`` with the trapezoidal rule; 1 is the most there may be.

    ``predicted`` is the step along the path's tangent at its start; the workspace holds a factor of
    the tangent at its end.
    """
    work.product[:] = 0.0
    for d in system.held:
        work.product[d] = motion[d] - work.saved[d]
    tangent_step(motion, system, work)
    # u1 - u0 = (t0 + t1) / 2
    work.trial[:] = motion - work.saved
    work.product[:] = work.trial - 0.5 * (predicted + work.step)
    most = max(CROOKED * length(work.trial, system.dofs, system), CROOKED_LENGTH)
    return length(work.product, system.dofs, system) / most


@inlined
def next_increment(increment: float, left: float, way: float, pace: Floats) -> float:
    """Part of the way for the next increment: none goes past where the eigenvalue may vanish."""
    if pace[RATE] >= 0.0:
        return min(increment, left)
    # lambda^2 falls linearly towards a limit point, and faster than that towards a branching
    expected = pace[VALUE] ** 2 / (-pace[RATE] * way)
    part = SOFT_PART if pace[VALUE] < SOFT * pace[FIRST] else STIFF_PART
    return min(increment, left, max(part * expected, SMALLEST_INCREMENT))


@compiled
def _newton_ahead(motion: Floats, system: System, work: Workspace) -> None:
    """Fills ``work.step`` with Newton's for the held dofs' part in ``work.product``.

    The workspace holds a factor of the tangent.
    """
    # K_ff du_f = -(r_f + K_fh du_h)
    gradient(motion, system, work.kinematics, work.force)
    work.trial[:] = work.force
    hessian_product(motion, system, work.kinematics, work.product, work.force)
    for d in system.dofs:
        work.force[d] += work.trial[d]
    solve_free(system, work)
    for d in system.held:
        work.step[d] = work.product[d]


@compiled
def step_ahead(
    motion: Floats, load: Floats, share: float, predicted: Floats, system: System, work: Workspace,
    counts: Ints,
) -> float:  # fmt: skip
    """Moves by a share of the way to a load, in steps that stop short of the barrier.

    The first goes along the path's tangent. Where the barrier cuts it short, Newton's follow, free
    and held dofs together, so that contacts need not come to rest again and again on the way.

    Returns:
        the part of that share gone; ``predicted`` is filled with the path's tangent for it.
    """
    work.saved[:] = motion
    towards(motion, load, share, system, work)
    tangent_step(motion, system, work)
    predicted[:] = work.step
    gone = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
    motion += gone * work.step
    for _ in range(STEPS_AHEAD):
        if gone == 1.0 or not factorise_tangent(motion, system, work, 0.0, counts):
            break
        left = share * (1.0 - gone) / (1.0 - share * gone)
        towards(motion, load, left, system, work)
        _newton_ahead(motion, system, work)
        allowed = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
        motion += allowed * work.step
        gone = 1.0 if allowed == 1.0 else gone + allowed * (1.0 - gone)
    predicted *= gone
    if gone == 1.0 and share == 1.0:
        for i in range(len(system.held)):
            motion[system.held[i]] = load[i]
    return gone
