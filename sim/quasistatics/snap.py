"""Leaves a limit point or a branching as damped motion does, compiled.

Where a stable path ends the structure snaps: held as it is there, it moves without inertia against
its viscous damping, C dq/dt = -dE/dq, until it comes to rest. That rest depends on the critical
point alone, not on the loads by which the path came to it.
"""

import numpy as np

from sim.collision import units_met
from sim.core import Floats, Ints, compiled
from sim.energy import System, Workspace, admissible_step, gradient, tangent
from sim.linalg import add, clear, factorise, solve
from sim.quasistatics.newton import (
    FACTORS,
    KEEP_FROM_BARRIER,
    correct,
    factorise_tangent,
    solve_free,
)

GAMMA = 1.0 + np.sqrt(0.5)
"""Of the Rosenbrock method ROS2, L-stable and without overshoot of stiff contacts (Verwer et al.
1999, SIAM J. Sci. Comput. 20, 1456)."""
FLOW_ERROR = 3e-3
"""Local error of a step of the damped motion, mm."""
AT_REST = 0.02
"""Newton step below which the damped motion ends in the minimum that the step leads to, mm."""
CLOSER = 0.5
"""Factor of that limit after a step that led to no minimum."""
SLOWER, PATIENCE = 0.5, 10
"""Speed at which rest is looked for, over the fastest since it was last, and the number of steps
after which it is anyway."""
FIRST_STEP = 1.0
"""First step of the damped motion, times the drag over the median axial stiffness."""
LONGER, LONGER_AGAIN, TOO_LONG = 5.0, 1.5, 0.5
"""Limit of the next step over the last, the factor by which that comes back after 1 at a rejection,
and the factor on a rejected step at most: while the structure leaves a critical point, the longest
step for which the system is positive definite shrinks."""
MAX_STEPS = 5000
PUSH = 1e-2
"""Largest movement by which a critical point is left along its mode, mm."""


@compiled
def lowest_mode(
    system: System, work: Workspace, mode: Floats, sweeps: int, tolerance: float
) -> float:
    """Finds the smallest eigenvalue (N/mm) of K v = lambda S^2 v by inverse iteration.

    S is the system's scale; the workspace holds the factor of the tangent K. `mode` (n_free,) is an
    estimate of the eigenvector S v, replaced by a better one of length 1 after so many `sweeps` or
    once the eigenvalue changes, relatively, by less than the tolerance.
    """
    value = np.inf
    for _ in range(sweeps):
        for i in range(len(mode)):
            work.right[i] = mode[i] * system.scale[system.dofs[i]]
        solve(work.matrix, work.right)
        along, square = 0.0, 0.0
        for i in range(len(mode)):
            work.right[i] *= system.scale[system.dofs[i]]
            along += work.right[i] * mode[i]
            square += work.right[i] ** 2
        before, value = value, along / square  # the Rayleigh quotient of K
        mode[:] = work.right / np.sqrt(square)
        if abs(before - value) <= tolerance * abs(value):
            break
    return value


@compiled
def push(motion: Floats, mode: Floats, sense: float, system: System, work: Workspace) -> None:
    """Moves ``motion`` by ``PUSH`` along a mode, in one of its two senses."""
    largest = np.abs(mode).max()
    work.step[:] = 0.0
    for i in range(len(mode)):
        d = system.dofs[i]
        work.step[d] = sense * PUSH * mode[i] / (largest * system.scale[d])
    allowed = KEEP_FROM_BARRIER * admissible_step(motion, system, work.step)
    motion += min(1.0, allowed) * work.step


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
    h = FIRST_STEP * drag[system.dofs].min() / float(np.median(system.net.law[:, 0]))
    near, fastest, steps, growth = AT_REST, 0.0, 0, LONGER
    gradient(motion, system, work.kinematics, work.force)
    for _ in range(MAX_STEPS):
        if units_met(system.contacts):  # no step is short enough
            return False
        if not _ros2(motion, drag, h, system, work, counts):
            h *= TOO_LONG
            growth = 1.0
            continue
        # work.product: the step of second order; work.guess: its difference from one of first
        error, moved = _largest(work.guess, system), _largest(work.product, system)
        allowed = KEEP_FROM_BARRIER * admissible_step(motion, system, work.product)
        longer = 0.8 * np.sqrt(FLOW_ERROR / max(error, 1e-300))
        if error > FLOW_ERROR or allowed < 1.0:
            h *= min(TOO_LONG, max(0.2, longer))
            growth = 1.0
            continue
        speed = moved / h
        h *= min(growth, longer)
        growth = min(LONGER, LONGER_AGAIN * growth)
        motion += work.product
        gradient(motion, system, work.kinematics, work.force)
        steps += 1
        fastest = max(fastest, speed)
        if moved >= AT_REST or (speed > SLOWER * fastest and steps < PATIENCE):
            continue
        fastest, steps = speed, 0
        if factorise_tangent(motion, system, work, 0.0, counts):
            solve_free(system, work)
            if _largest(work.step, system) < near:
                # just beyond a limit point the motion is as slow as at rest, and no minimum is near
                work.guess[:] = motion
                if correct(motion, relative, absolute, False, system, work, counts):
                    return factorise_tangent(motion, system, work, 0.0, counts)
                motion[:] = work.guess
                gradient(motion, system, work.kinematics, work.force)
                near *= CLOSER
    return False


@compiled
def _largest(step: Floats, system: System) -> float:
    largest = 0.0
    for d in system.dofs:
        largest = max(largest, abs(step[d]) * system.scale[d])
    return largest


@compiled
def _ros2(
    motion: Floats, drag: Floats, h: float, system: System, work: Workspace, counts: Ints
) -> bool:
    """Fills ``work.product`` with a step of the damped motion; False if it is too long for that.

    The workspace holds gradient and kinematics at ``motion``; ``work.guess`` is filled with the
    difference from the step of first order.
    """
    counts[FACTORS] += 1
    clear(work.matrix)
    tangent(motion, system, work.kinematics, work.matrix)
    for i in range(len(system.dofs)):
        add(work.matrix, i, i, drag[system.dofs[i]] / (GAMMA * h))
    if not factorise(work.matrix):
        return False
    # (K + C / (gamma h)) d1 = -g(q) / gamma
    solve_free(system, work)
    work.product[:] = work.step / GAMMA
    work.trial[:] = motion + work.product
    if KEEP_FROM_BARRIER * admissible_step(motion, system, work.product) < 1.0:
        gradient(motion, system, work.kinematics, work.force)
        return False
    gradient(work.trial, system, work.kinematics, work.force)
    # (K + C / (gamma h)) d2 = -g(q + d1) / gamma - 2 C d1 / (gamma h)
    for d in system.dofs:
        work.force[d] = (work.force[d] + 2.0 * drag[d] * work.product[d] / h) / GAMMA
    solve_free(system, work)
    work.guess[:] = 0.5 * (work.product + work.step)
    work.product[:] = work.product + work.guess
    gradient(motion, system, work.kinematics, work.force)
    return True
