"""Follows equilibrium paths by Newton continuation, compiled, with their exact adjoint.

Between two output loads the increment adapts itself. An increment is smooth if no tangent on the
way or at its end was indefinite and the motion is that of the trapezoidal rule; one that is not is
cut, and none is longer than the smallest eigenvalue of the tangent lets expect, so that the path is
followed up to where it ends: a limit point or a branching. From there it goes on in the state that
damped motion comes to, and the critical point is recorded.
"""

from typing import NamedTuple

import numpy as np

from sim.collision import units_met
from sim.core import Floats, Ints, compiled, inlined
from sim.energy import (
    Bars,
    System,
    Workspace,
    admissible_step,
    hessian_product,
    mixed,
)
from sim.quasistatics.increments import (
    FIRST,
    INCREMENT,
    RATE,
    SMALLEST_INCREMENT,
    VALUE,
    crookedness,
    length,
    next_increment,
    step_ahead,
    tangent_step,
    towards,
)
from sim.quasistatics.newton import (
    INCREMENTS,
    KEEP_FROM_BARRIER,
    correct,
    factorise_shifted,
    factorise_tangent,
    solve_free,
)
from sim.quasistatics.path_ends import (
    EIGENVALUE,
    LIMIT_POINT,
    SMOOTH,
    SWEEPS_AT_LOADS,
    come_to_rest,
    leave,
    scatter,
)
from sim.quasistatics.snap import lowest_mode

CLOSE = 1e-6
"""Part of the way that the end of a path is passed by."""
SHORTER, LONGER = 0.25, 4.0
"""Limits of the next increment over the last."""
SHORT = 0.2
"""Correction of a known step at most, over its length."""
SINGULAR = 1e-6
"""Eigenvalue over the first state's up to which a path has ended: beyond, the residual's tolerance
does not fix the critical mode."""
SWEEPS = 2
"""Inverse iterations for the eigenvalue of an increment."""
SCATTER = 0.5
"""Length of numbers without symmetry that are added to the last mode at an output load."""
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
def _settle(
    motion: Floats, relative: float, absolute: float, system: System, work: Workspace, counts: Ints
) -> bool:  # fmt: skip
    """Corrects a motion; tells whether no tangent was indefinite, that at the end included.

    The workspace then holds a factor of that.
    """
    found = correct(motion, relative, absolute, False, system, work, counts)
    return found and factorise_tangent(motion, system, work, 0.0, counts)


@inlined
def _first_kind(before: int, end: int) -> int:
    """Kind of a way whose ends so far were of one kind, and the next is of another."""
    return end if before == SMOOTH else before


@inlined
def _note(snaps: Floats, place: float) -> None:
    for i in range(len(snaps)):
        if np.isnan(snaps[i]):
            snaps[i] = place
            break


@compiled
def _advance(
    motion: Floats, load: Floats, number: int, leaves: bool, sense: float, pace: Floats,
    mode: Floats, predicted: Floats, drag: Floats, relative: float, absolute: float, system: System,
    work: Workspace, snaps: Floats, counts: Ints,
) -> tuple[float, int, float]:  # fmt: skip
    """Follows the path to one load; the workspace holds a factor of the tangent before and after.

    `motion` is moved; `load` (n_held,) is that of `number`; `pace` (4,), see ``INCREMENT``, and
    `mode` (n_free,), the eigenvector S v of the smallest eigenvalue, change; `predicted` (n_dofs,)
    is scratch; `snaps` gathers them. Unless it `leaves`, it stops where the path ends; it does
    where units met for which the tangent has no room. For the rest see `leave`.

    Returns:
        the fraction of the way reached, with ``motion`` there; the kind of the way, that of its
        first end; and where on it the path ended last, NaN if it did not.
    """
    towards(motion, load, 1.0, system, work)
    way = length(work.product, system.held, system)
    done, kind, ended = 0.0, SMOOTH, np.nan
    while done < 1.0 and not units_met(system.contacts):
        counts[INCREMENTS] += 1
        ahead = next_increment(pace[INCREMENT], 1.0 - done, way, pace)
        share = ahead / (1.0 - done)
        gone = ahead * step_ahead(motion, load, share, predicted, system, work, counts)
        if not gone >= min(SMALLEST_INCREMENT, ahead):  # held units drive a void into its barrier
            motion[:] = work.saved
            break
        last = share == 1.0 and gone == ahead
        smooth = _settle(motion, relative, absolute, system, work, counts)
        crooked = crookedness(motion, predicted, system, work) if smooth else np.inf
        change = min(LONGER, max(SHORTER, 0.9 / np.sqrt(max(crooked, 1e-300))))
        if crooked <= 1.0:
            done = 1.0 if last else done + gone
            value = lowest_mode(system, work, mode, SWEEPS, 0.0)
            pace[RATE] = (value**2 - pace[VALUE] ** 2) / max(gone * way, 1e-300)
            pace[VALUE] = value
            pace[INCREMENT] = min(1.0, max(pace[INCREMENT] if last else CLOSE, change * gone))
            if value > SINGULAR * pace[FIRST] or done == 1.0:
                continue
        else:
            motion[:] = work.saved
            pace[INCREMENT] = min(change, 0.9) * gone
            if factorise_shifted(motion, system, work, counts) < 0.0:
                break
            if pace[INCREMENT] >= SMALLEST_INCREMENT:
                continue
        if not leaves:
            _note(snaps, number + done)
            return done, LIMIT_POINT, done
        beyond = min(1.0, CLOSE / (1.0 - done))
        share, end = leave(
            motion, load, beyond, mode, sense, pace[FIRST], drag, relative, absolute, system,
            work, counts,
        )  # fmt: skip
        if share < 0.0:
            break
        if end != SMOOTH:
            kind, ended = _first_kind(kind, end), done
            _note(snaps, number + done)
        done = 1.0 if share == 1.0 else done + share * (1.0 - done)
        pace[INCREMENT], pace[RATE] = CLOSE, 0.0
        pace[VALUE] = lowest_mode(system, work, mode, SWEEPS, 0.0)
    return done, kind, ended


@compiled
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
    work.guess[:] = motion
    smooth = _settle(motion, relative, absolute, system, work, counts)
    work.guess[:] = motion - work.guess
    short = SHORT * length(step, system.dofs, system)
    if not (smooth and length(work.guess, system.dofs, system) <= short):
        motion[:] = work.saved
        factorise_shifted(motion, system, work, counts)
        return False
    return True


@compiled
def follow(
    loads: Floats, known: int, pace: Floats, bends: Floats, trusted: Ints, leaves: bool,
    sense: float, system: System, work: Workspace, relative: float, absolute: float, drag: Floats,
    branch: Branch, counts: Ints,
) -> tuple[int, float]:  # fmt: skip
    """Fills a branch with the equilibria at ``loads`` (n_loads, n_held), the first `known` kept.

    `pace` (4,), see ``INCREMENT``, is that with which these were found. `bends` (n_loads, n_dofs)
    is by how much the path of a similar structure departs from its tangent between two loads, to be
    tried first where `trusted` (n_loads,). Where the path ends, the structure `leaves` it, or the
    branch ends as well. The critical mode of a branching is followed in the `sense` 1 or -1. `work`
    is room for the states. The residual's tolerance is relative to the largest reaction, its floor
    `absolute` in N; `drag` (n_dofs,) is that of the damped motion after a snap; `counts` (4,)
    gathers the work.

    Returns:
        the number of loads reached, and the fraction of the way to the next.
    """
    motion, step = np.zeros(len(system.mass)), np.empty(len(system.mass))
    mode = np.empty(len(system.dofs))
    if known == 0:
        first, end = come_to_rest(
            motion, mode, sense, drag, relative, absolute, system, work, counts
        )
        if first < 0.0:
            return 0, 0.0
        if end != SMOOTH:
            branch.jumped[0], branch.snapped[0], branch.snaps[0] = end, 0.0, 0.0
        pace[VALUE] = pace[FIRST] = first
    else:
        motion[:] = branch.states[known - 1]
        factorise_tangent(motion, system, work, 0.0, counts)
        mode[:] = scatter(len(mode))
        pace[VALUE] = lowest_mode(system, work, mode, SWEEPS_AT_LOADS, EIGENVALUE)
    pace[INCREMENT], pace[RATE] = 1.0, 0.0
    for p in range(known, len(loads)):
        done = 0.0
        towards(motion, loads[p], 1.0, system, work)
        tangent_step(motion, system, work)
        branch.tangents[p] = work.step
        if trusted[p]:
            step[:] = work.step + bends[p]
            if _repeat(motion, loads[p], step, relative, absolute, system, work, counts):
                done, pace[RATE] = 1.0, 0.0
        if done < 1.0:
            done, kind, ended = _advance(
                motion, loads[p], p, leaves, sense, pace, mode, step, drag, relative, absolute,
                system, work, branch.snaps, counts,
            )  # fmt: skip
            branch.jumped[p] = _first_kind(branch.jumped[p], kind)
            if not np.isnan(ended):  # that of coming to rest stays where the way is smooth
                branch.snapped[p] = ended
        branch.states[p] = motion
        if done < 1.0 or units_met(system.contacts):
            return p, done
        # of a symmetric structure the last mode has nothing of one that has crossed it
        mode += SCATTER / np.sqrt(len(mode)) * scatter(len(mode))
        pace[VALUE] = lowest_mode(system, work, mode, SWEEPS_AT_LOADS, EIGENVALUE)
        branch.eigenvalue[p], branch.stable[p] = pace[VALUE], 1
    return len(loads), 0.0


@compiled
def adjoint(
    states: Floats, bar: Floats, system: System, work: Workspace, which: Ints, bars: Bars
) -> int:
    """Adds the derivatives of a loss with derivatives ``bar`` (n_loads, n_dofs) by ``states``.

    Returns:
        the first load whose tangent is not positive definite, or -1.
    """
    counts = np.zeros(4, dtype=np.int64)
    for p in range(len(states)):
        if np.abs(bar[p]).max() == 0.0:
            continue
        if not factorise_tangent(states[p], system, work, 0.0, counts):
            return p
        work.force[:] = bar[p]
        solve_free(system, work)
        mixed(states[p], system, work.kinematics, work.step, which, bars.sensitivity)
        hessian_product(states[p], system, work.kinematics, work.step, work.product)
        for i in range(len(system.held)):
            bars.drive[p, i] += work.product[system.held[i]]
    return -1
