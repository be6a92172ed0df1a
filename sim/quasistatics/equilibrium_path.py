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
    gradient,
    hessian_product,
    locate,
    mixed,
)
from sim.quasistatics.newton import (
    INCREMENTS,
    KEEP_FROM_BARRIER,
    correct,
    factorise_shifted,
    factorise_tangent,
    solve_free,
)
from sim.quasistatics.snap import lowest_mode, push, relax

SMALLEST_INCREMENT = 1e-8
"""Part of the way between two loads below which the path has ended."""
CLOSE = 1e-6
"""Part of the way that the end of a path is passed by."""
CROOKED, CROOKED_LENGTH = 0.05, 1e-5
"""Departure of a smooth increment from the trapezoidal rule at most, over its length and in mm."""
SHORTER, LONGER = 0.25, 4.0
"""Limits of the next increment over the last."""
STEPS_AHEAD = 6
"""Newton steps at most by which an increment goes on where the barrier cuts its first step."""
SHORT = 0.2
"""Correction of a known step at most, over its length."""
STIFF_PART, SOFT_PART = 0.75, 0.5
"""Part of the way to where the eigenvalue is expected to vanish that an increment goes at most: of
a stiff structure, and of a soft one, as more of the path to a limit point is too crooked."""
SOFT, SINGULAR = 0.5, 1e-6
"""Eigenvalue over the first state's up to which a structure is soft, and up to which a path has
ended: beyond, the residual's tolerance does not fix the critical mode."""
CRITICAL = 1e-3
"""Eigenvalue at the end of a path below which it is singular there, over the first state's."""
UNLOADED = 1e-7
"""Share of the load that acts on a critical mode up to which it does not: there the path branches,
elsewhere it turns back in a limit point."""
NOTICEABLE = 1e-2
"""Movement at the end of a path that is a jump, mm."""
BEYOND = 1e-3
"""Way of the held dofs by which a branching is passed, mm: nearer to it no state is stable enough
to be found."""
SWEEPS, SWEEPS_AT_LOADS = 2, 40
"""Inverse iterations for the eigenvalue of an increment and of an output load at most."""
EIGENVALUE = 1e-6
"""Relative change that ends them."""
SCATTER = 0.5
"""Length of numbers without symmetry that are added to the last mode at an output load."""

INCREMENT, VALUE, RATE, FIRST = 0, 1, 2, 3
"""Places in the pace: part of the way to go next, smallest eigenvalue, rate of change of its square
over the length of the held dofs' way, and eigenvalue of the first state."""
MOST_SNAPS = 64
"""Snaps of a path that are recorded."""
SMOOTH, LIMIT_POINT, BRANCHING = 0, 1, 2
"""Kinds of the way to a load."""


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
def _tangent_step(motion: Floats, system: System, work: Workspace) -> None:
    """Fills ``work.step`` with that of the path for the held dofs' part in ``work.product``."""
    # K_ff du_f = -K_fh du_h
    locate(motion, system, work.kinematics)
    hessian_product(motion, system, work.kinematics, work.product, work.force)
    solve_free(system, work)
    for d in system.held:
        work.step[d] = work.product[d]


@inlined
def _towards(motion: Floats, load: Floats, share: float, system: System, work: Workspace) -> None:
    """Fills ``work.product`` with a share of the held dofs' way to a load."""
    work.product[:] = 0.0
    for i in range(len(system.held)):
        d = system.held[i]
        work.product[d] = (load[i] - motion[d]) * share


@inlined
def _length(step: Floats, dofs: Ints, system: System) -> float:
    """Norm of a step's dofs, mm."""
    total = 0.0
    for d in dofs:
        total += (step[d] * system.scale[d]) ** 2
    return np.sqrt(total)


@compiled
def _settle(
    motion: Floats, relative: float, absolute: float, system: System, work: Workspace, counts: Ints
) -> bool:  # fmt: skip
    """Corrects a motion; tells whether no tangent was indefinite, that at the end included.

    The workspace then holds a factor of that.
    """
    found = correct(motion, relative, absolute, False, system, work, counts)
    return found and factorise_tangent(motion, system, work, 0.0, counts)


@compiled
def _crooked(motion: Floats, predicted: Floats, system: System, work: Workspace) -> float:
    """Compares the way from ``work.saved`` with the trapezoidal rule; 1 is the most there may be.

    ``predicted`` is the step along the path's tangent at its start; the workspace holds a factor of
    the tangent at its end.
    """
    work.product[:] = 0.0
    for d in system.held:
        work.product[d] = motion[d] - work.saved[d]
    _tangent_step(motion, system, work)
    # u1 - u0 = (t0 + t1) / 2
    work.trial[:] = motion - work.saved
    work.product[:] = work.trial - 0.5 * (predicted + work.step)
    most = max(CROOKED * _length(work.trial, system.dofs, system), CROOKED_LENGTH)
    return _length(work.product, system.dofs, system) / most


@inlined
def _scatter(mode: Floats) -> None:
    """Fills an estimate of a mode with fixed numbers that have no symmetry."""
    mode[:] = np.sin(1.0 + np.arange(len(mode)))


@compiled
def _leave(
    motion: Floats, load: Floats, ahead: float, mode: Floats, sense: float, first: float,
    drag: Floats, relative: float, absolute: float, system: System, work: Workspace, counts: Ints,
) -> tuple[float, int]:  # fmt: skip
    """Goes on from the end of a path by damped motion; returns the part of the way gone, and how.

    `motion`, at the end, is moved; `ahead` is the part of the way to `load` (n_held,) beyond it.
    `mode` (n_free,) is filled with the critical one, S v; a branching is left along it (`sense` 1)
    or against it (-1). `first` is the eigenvalue of the first state. Tolerances are those of
    `follow`. The workspace holds a factor of the tangent before and after. The part is negative if
    the structure came to no rest.

    Returns:
        the part of the way gone, negative if the structure came to no rest; and the kind of the
        path's end.
    """
    work.saved[:] = motion
    # of mirrored modes that are critical at once the mixture depends on the start of the iteration
    _scatter(mode)
    value = lowest_mode(system, work, mode, SWEEPS_AT_LOADS, EIGENVALUE)
    _towards(motion, load, 1.0, system, work)
    way = _length(work.product, system.held, system)
    locate(motion, system, work.kinematics)
    hessian_product(motion, system, work.kinematics, work.product, work.force)
    along, force = 0.0, 0.0
    for i in range(len(mode)):
        d = system.dofs[i]
        along -= mode[i] * work.force[d] / system.scale[d]
        force += (work.force[d] / system.scale[d]) ** 2
    branches = abs(along) <= UNLOADED * np.sqrt(force)
    if branches:
        along = sense
        ahead = max(ahead, min(1.0, BEYOND / max(way, BEYOND)))
    for i in range(len(system.held)):
        d = system.held[i]
        motion[d] = load[i] if ahead == 1.0 else motion[d] + ahead * (load[i] - motion[d])
    push(motion, mode, np.sign(along), system, work)
    if not relax(motion, drag, relative, absolute, system, work, counts):
        return -1.0, LIMIT_POINT
    work.trial[:] = motion - work.saved
    if branches and abs(value) < CRITICAL * first:
        return ahead, BRANCHING
    jumped = _length(work.trial, system.dofs, system) > NOTICEABLE
    return ahead, LIMIT_POINT if jumped else SMOOTH


@inlined
def _ahead(increment: float, left: float, way: float, pace: Floats) -> float:
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
def _step_ahead(
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
    _towards(motion, load, share, system, work)
    _tangent_step(motion, system, work)
    predicted[:] = work.step
    gone = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
    motion += gone * work.step
    for _ in range(STEPS_AHEAD):
        if gone == 1.0 or not factorise_tangent(motion, system, work, 0.0, counts):
            break
        left = share * (1.0 - gone) / (1.0 - share * gone)
        _towards(motion, load, left, system, work)
        _newton_ahead(motion, system, work)
        allowed = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
        motion += allowed * work.step
        gone = 1.0 if allowed == 1.0 else gone + allowed * (1.0 - gone)
    predicted *= gone
    if gone == 1.0 and share == 1.0:
        for i in range(len(system.held)):
            motion[system.held[i]] = load[i]
    return gone


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
    where units met for which the tangent has no room. For the rest see `_leave`.

    Returns:
        the fraction of the way reached, with ``motion`` there; the kind of the way, that of its
        first end; and where on it the path ended last, NaN if it did not.
    """
    _towards(motion, load, 1.0, system, work)
    way = _length(work.product, system.held, system)
    done, kind, ended = 0.0, SMOOTH, np.nan
    while done < 1.0 and not units_met(system.contacts):
        counts[INCREMENTS] += 1
        ahead = _ahead(pace[INCREMENT], 1.0 - done, way, pace)
        share = ahead / (1.0 - done)
        gone = ahead * _step_ahead(motion, load, share, predicted, system, work, counts)
        if not gone >= min(SMALLEST_INCREMENT, ahead):  # held units drive a void into its barrier
            motion[:] = work.saved
            break
        last = share == 1.0 and gone == ahead
        smooth = _settle(motion, relative, absolute, system, work, counts)
        crooked = _crooked(motion, predicted, system, work) if smooth else np.inf
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
        share, end = _leave(
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
    short = SHORT * _length(step, system.dofs, system)
    if not (smooth and _length(work.guess, system.dofs, system) <= short):
        motion[:] = work.saved
        factorise_shifted(motion, system, work, counts)
        return False
    return True


@compiled
def _come_to_rest(
    motion: Floats, mode: Floats, sense: float, drag: Floats, relative: float, absolute: float,
    system: System, work: Workspace, counts: Ints,
) -> tuple[float, int]:  # fmt: skip
    """Moves the unloaded structure to its equilibrium, as a void may start in contact.

    Returns:
        the smallest eigenvalue there, negative if there is none; and the kind of the way.
    """
    _scatter(mode)
    end = SMOOTH
    if not correct(motion, relative, absolute, True, system, work, counts):
        return -1.0, end
    if not factorise_tangent(motion, system, work, 0.0, counts):
        factorise_shifted(motion, system, work, counts)
        share, end = _leave(
            motion, motion[system.held], 0.0, mode, sense, np.inf, drag, relative, absolute,
            system, work, counts,
        )  # fmt: skip
        if share < 0.0:
            return -1.0, end
    return lowest_mode(system, work, mode, SWEEPS_AT_LOADS, EIGENVALUE), end


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
        first, end = _come_to_rest(
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
        _scatter(mode)
        pace[VALUE] = lowest_mode(system, work, mode, SWEEPS_AT_LOADS, EIGENVALUE)
    pace[INCREMENT], pace[RATE] = 1.0, 0.0
    for p in range(known, len(loads)):
        done = 0.0
        _towards(motion, loads[p], 1.0, system, work)
        _tangent_step(motion, system, work)
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
        mode += SCATTER / np.sqrt(len(mode)) * np.sin(1.0 + np.arange(len(mode)))
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
