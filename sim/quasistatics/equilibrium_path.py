"""Follows equilibrium paths by Newton continuation, compiled, with their exact adjoint.

Between two output loads the increment adapts itself. An increment is smooth if no tangent on the
way was indefinite and the correction is short beside the step predicted; one that is not is cut, so
that the path is followed up to where it ends: a limit point or a branching. There the structure
jumps: the energy is descended to a minimum at the next load, and the jump is recorded.
"""

from __future__ import annotations

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import Bars, System, Workspace, admissible_step, hessian_product, mixed, workspace
from sim.quasistatics.newton import (
    FACTORS,
    INCREMENTS,
    KEEP_FROM_BARRIER,
    SHIFTED,
    correct,
    factorise_shifted,
    factorise_tangent,
    leave_saddle,
    solve_free,
)

SMALLEST_INCREMENT = 1e-6
SMALLEST_SMOOTH = 1e-3
"""Part of the way between two loads below which an increment that is not smooth is a jump."""
SHORT = 0.5
"""Correction of a smooth increment at most, over the step predicted."""
ON_THE_WAY = 1e-3
"""Relative residual that suffices between two output loads."""
EASY = 5
"""Factorisations of a correction after which the next increment is doubled."""
MAX_SADDLES = 4


@inlined
def _predict(motion: Floats, load: Floats, share: float, system: System, work: Workspace) -> None:
    """Fills ``work.step`` along the path: the held dofs by ``share`` of the way to ``load``."""
    work.product[:] = 0.0
    for i in range(len(system.held)):
        d = system.held[i]
        work.product[d] = (load[i] - motion[d]) * share
    # K_ff du_f = -K_fh du_h
    hessian_product(motion, system, work.turn, work.product, work.force)
    solve_free(system, work)
    for d in system.held:
        work.step[d] = work.product[d]


@inlined
def _length(one: Floats, other: Floats, system: System) -> float:
    """Distance of the free dofs of two motions, mm."""
    total = 0.0
    for d in system.dofs:
        total += ((one[d] - other[d]) * system.scale[d]) ** 2
    return np.sqrt(total)


@inlined
def _settle(
    motion: Floats, predicted: float, relative: float, absolute: float, system: System,
    work: Workspace, counts: Ints,
) -> tuple[bool, bool]:  # fmt: skip
    """Corrects a motion that was predicted over the length ``predicted``.

    Returns:
        whether it is in balance now, and whether that was smooth.
    """
    shifted = counts[SHIFTED]
    work.guess[:] = motion
    found = correct(motion, relative, absolute, system, work, counts)
    short = _length(motion, work.guess, system) <= SHORT * predicted
    return found, short and counts[SHIFTED] == shifted


@compiled
def _stabilise(
    motion: Floats, relative: float, absolute: float, system: System, work: Workspace, counts: Ints
) -> tuple[bool, bool]:
    """Leaves the saddles that ``motion`` may be on, and factorises the tangent.

    Returns:
        whether the tangent is positive definite, and whether a saddle was left.
    """
    for saddles in range(MAX_SADDLES):
        if factorise_tangent(motion, system, work, 0.0, counts):
            return True, saddles > 0
        leave_saddle(motion, system, work, counts)
        if not correct(motion, relative, absolute, system, work, counts):
            return False, True
    return factorise_tangent(motion, system, work, 0.0, counts), True


@inlined
def _advance(
    motion: Floats, load: Floats, relative: float, absolute: float, increment: float,
    system: System, work: Workspace, counts: Ints,
) -> tuple[float, float, bool]:  # fmt: skip
    """Follows the path to one load; the workspace holds a factor of the tangent before and after.

    Returns:
        the fraction of the way reached, with ``motion`` there; the increment to go on with; and
        whether the structure jumped.
    """
    done, jumped = 0.0, False
    while done < 1.0:
        work.saved[:] = motion
        counts[INCREMENTS] += 1
        ahead = min(increment, 1.0 - done)
        _predict(motion, load, ahead / (1.0 - done), system, work)
        allowed = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
        if not allowed * ahead >= SMALLEST_INCREMENT:  # held units drive a void into its barrier
            return done, increment, jumped
        motion += allowed * work.step
        last = allowed == 1.0 and ahead == 1.0 - done
        if last:
            for i in range(len(system.held)):
                motion[system.held[i]] = load[i]
        before = counts[FACTORS]
        wanted = relative if last else ON_THE_WAY
        predicted = _length(motion, work.saved, system)
        found, smooth = _settle(motion, predicted, wanted, absolute, system, work, counts)
        if found and not smooth and allowed * ahead <= SMALLEST_SMOOTH:
            found, _ = _stabilise(motion, relative, absolute, system, work, counts)
            smooth = jumped = True
        if found and smooth:
            done = 1.0 if last else done + allowed * ahead
            if counts[FACTORS] - before <= EASY:
                increment = min(1.0, 2.0 * increment)
        else:
            motion[:] = work.saved
            increment = 0.25 * allowed * ahead
            usable = factorise_shifted(motion, system, work, counts) >= 0.0
            if increment < SMALLEST_INCREMENT or not usable:
                return done, increment, jumped
    return done, increment, jumped


@inlined
def _repeat(
    motion: Floats, load: Floats, step: Floats, relative: float, absolute: float, system: System,
    work: Workspace, counts: Ints,
) -> bool:  # fmt: skip
    """Goes to a load by a step known from a similar structure; False if that is not smooth."""
    work.saved[:] = motion
    if KEEP_FROM_BARRIER * admissible_step(motion, system, step) < 1.0:
        return False
    motion += step
    for i in range(len(system.held)):
        motion[system.held[i]] = load[i]
    predicted = _length(motion, work.saved, system)
    found, smooth = _settle(motion, predicted, relative, absolute, system, work, counts)
    if not (found and smooth):
        motion[:] = work.saved
    return found and smooth


@compiled
def follow(
    loads: Floats, bends: Floats, trusted: Ints, system: System, relative: float, absolute: float,
    states: Floats, tangents: Floats, stable: Ints, jumped: Ints, counts: Ints,
) -> tuple[int, float]:  # fmt: skip
    """Fills ``states`` (n_loads, n_dofs) with the equilibria at ``loads`` (n_loads, n_held).

    Args:
        loads: the path.
        bends: (n_loads, n_dofs) by how much the path of a similar structure departs from its
            tangent between two loads, to be tried first.
        trusted: (n_loads,) whether to try that.
        system: the structure.
        relative: tolerance of the residual, relative to the largest reaction.
        absolute: its floor, N.
        states: filled.
        tangents: (n_loads, n_dofs) filled: step to each load along the tangent at the one before.
        stable: (n_loads,) filled: whether the tangent there is positive definite.
        jumped: (n_loads,) filled: whether the structure jumped on the way there.
        counts: (4,) gathers the work.

    Returns:
        the number of loads reached, and the fraction of the way to the next.
    """
    work = workspace(system)
    motion, step = np.zeros(len(system.mass)), np.empty(len(system.mass))
    # rest itself may be out of balance: a void may start in contact
    if not correct(motion, relative, absolute, system, work, counts):
        return 0, 0.0
    positive, left = _stabilise(motion, relative, absolute, system, work, counts)
    jumped[0] = left
    increment = 1.0
    for p in range(len(loads)):
        done, leapt = 0.0, False
        _predict(motion, loads[p], 1.0, system, work)
        tangents[p] = work.step
        if trusted[p]:
            step[:] = work.step + bends[p]
            if _repeat(motion, loads[p], step, relative, absolute, system, work, counts):
                done = 1.0
            else:
                factorise_shifted(motion, system, work, counts)
        if done < 1.0:
            done, increment, leapt = _advance(
                motion, loads[p], relative, absolute, increment, system, work, counts
            )
        states[p] = motion
        if done < 1.0:
            return p, done
        positive, left = _stabilise(motion, relative, absolute, system, work, counts)
        states[p], stable[p] = motion, positive
        jumped[p] = jumped[p] or leapt or left
    return len(loads), 0.0


@compiled
def adjoint(states: Floats, bar: Floats, system: System, which: Ints, bars: Bars) -> int:
    """Adds the derivatives of a loss with derivatives ``bar`` (n_loads, n_dofs) by ``states``.

    Returns:
        the first load whose tangent is not positive definite, or -1.
    """
    work = workspace(system)
    counts = np.zeros(4, dtype=np.int64)
    for p in range(len(states)):
        if np.abs(bar[p]).max() == 0.0:
            continue
        if not factorise_tangent(states[p], system, work, 0.0, counts):
            return p
        work.force[:] = bar[p]
        solve_free(system, work)
        mixed(states[p], system, work.turn, work.step, which, bars.sensitivity)
        hessian_product(states[p], system, work.turn, work.step, work.product)
        for i in range(len(system.held)):
            bars.drive[p, i] += work.product[system.held[i]]
    return -1
