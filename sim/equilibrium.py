"""Compiled equilibrium paths by Newton continuation, and their exact adjoint.

Between two asked loads the increment adapts itself. A predictor along the path and every correction
stop short of the contact barrier. Corrections descend the energy: an indefinite tangent is shifted
until it is positive definite, so that the path ends in minima and leaves saddles.
"""

from __future__ import annotations

import numpy as np

from sim.arrays import Floats, Ints
from sim.compiling import compiled
from sim.matrix import add, clear, factorise, solve
from sim.potential import admissible_step, gradient, hessian_product, mixed, tangent
from sim.system import Bars, System, Workspace, workspace

KEEP_FROM_BARRIER = 0.9
MAX_CORRECTIONS = 60
MAX_BACKTRACKS = 30
MAX_SHIFTS = 40
FIRST_SHIFT = 1e-4
"""Of an indefinite tangent, over the axial stiffness."""
SMALLEST_INCREMENT = 1e-6
ON_THE_WAY = 1e-3
"""Relative residual that suffices between two asked loads."""

GRADIENTS, FACTORS, SHIFTED, INCREMENTS = 0, 1, 2, 3
"""Places in the counts that the solvers gather."""


@compiled
def _residual(motion: Floats, system: System, work: Workspace) -> tuple[float, float, float]:
    """Energy, and the largest out-of-balance and reaction force (moments over the scale), N."""
    strain, contact = gradient(motion, system, work.turn, work.force)
    residual, reaction = 0.0, 0.0
    for d in system.dofs:
        residual = max(residual, abs(work.force[d]) / system.scale[d])
    for d in system.held:
        reaction = max(reaction, abs(work.force[d]) / system.scale[d])
    return strain + contact, residual, reaction


@compiled
def _factorise(motion: Floats, system: System, work: Workspace, shift: float) -> bool:
    clear(work.matrix)
    tangent(motion, system, work.turn, work.matrix)
    if shift > 0.0:
        for i in range(len(system.dofs)):
            add(work.matrix, i, i, shift * system.scale[system.dofs[i]] ** 2)
    return factorise(work.matrix)


@compiled
def _factorise_shifted(motion: Floats, system: System, work: Workspace, counts: Ints) -> int:
    """Factor of the tangent, shifted if need be; returns the shifts tried, -1 if none helped."""
    counts[FACTORS] += 1
    if _factorise(motion, system, work, 0.0):
        return 0
    counts[SHIFTED] += 1
    shift = FIRST_SHIFT * np.abs(system.net.law[:, 0]).max()
    for tries in range(1, MAX_SHIFTS):
        counts[FACTORS] += 1
        if _factorise(motion, system, work, shift):
            return tries
        shift *= 4.0
    return -1


@compiled
def _descend(
    motion: Floats, energy: float, residual: float, newton: bool, system: System, work: Workspace,
    trial: Floats, counts: Ints,
) -> tuple[bool, float, float, float]:  # fmt: skip
    """Moves ``motion`` along ``work.step`` by backtracking short of the barrier.

    A full Newton step that halves the residual passes too: near the end the energy is all rounding.

    Returns:
        whether a step was found, and energy, residual and reaction there.
    """
    slope = 0.0
    for d in system.dofs:
        slope += work.step[d] * work.force[d]
    length = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
    for _ in range(MAX_BACKTRACKS):
        trial[:] = motion + length * work.step
        new_energy, new_residual, reaction = _residual(trial, system, work)
        counts[GRADIENTS] += 1
        descends = new_energy <= energy + 1e-4 * length * slope
        if np.isfinite(new_energy) and (descends or (newton and new_residual < 0.5 * residual)):
            motion[:] = trial
            return True, new_energy, new_residual, reaction
        length *= 0.5
    return False, energy, residual, 0.0


@compiled
def _correct(
    motion: Floats, relative: float, absolute: float, system: System, work: Workspace,
    trial: Floats, counts: Ints,
) -> bool:  # fmt: skip
    """Newton descent at fixed held dofs; True once the residual is below its tolerance."""
    energy, residual, reaction = _residual(motion, system, work)
    counts[GRADIENTS] += 1
    for _ in range(MAX_CORRECTIONS):
        if residual <= max(relative * reaction, absolute):
            return True
        shifts = _factorise_shifted(motion, system, work, counts)
        if shifts < 0:
            return False
        _solve_free(system, work, -1.0)
        found, energy, residual, reaction = _descend(
            motion, energy, residual, shifts == 0, system, work, trial, counts
        )
        if not found:
            return False
    return False


@compiled
def _solve_free(system: System, work: Workspace, sign: float) -> None:
    """Solves for the free dofs of ``work.step`` with right-hand side ``sign`` times the force."""
    for i in range(len(system.dofs)):
        work.right[i] = sign * work.force[system.dofs[i]]
    solve(work.matrix, work.right)
    for d in system.held:
        work.step[d] = 0.0
    for i in range(len(system.dofs)):
        work.step[system.dofs[i]] = work.right[i]


@compiled
def _predict(motion: Floats, load: Floats, share: float, system: System, work: Workspace) -> None:
    """Fills ``work.step`` along the path: the held dofs by ``share`` of the way to ``load``."""
    work.product[:] = 0.0
    for i in range(len(system.held)):
        d = system.held[i]
        work.product[d] = (load[i] - motion[d]) * share
    hessian_product(motion, system, work.turn, work.product, work.force)
    _solve_free(system, work, -1.0)
    for d in system.held:
        work.step[d] = work.product[d]


@compiled
def _advance(
    motion: Floats, load: Floats, relative: float, absolute: float, increment: float,
    system: System, work: Workspace, saved: Floats, trial: Floats, counts: Ints,
) -> tuple[float, float]:  # fmt: skip
    """Follows the path to one load.

    Returns:
        the fraction of the way reached, with ``motion`` there, and the increment to go on with.
    """
    done = 0.0
    while done < 1.0:
        saved[:] = motion
        counts[INCREMENTS] += 1
        usable = _factorise_shifted(motion, system, work, counts) >= 0
        ahead = min(increment, 1.0 - done)
        _predict(motion, load, ahead / (1.0 - done), system, work)
        allowed = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
        if allowed * ahead < SMALLEST_INCREMENT:  # held units drive a void into its barrier
            return done, increment
        motion += allowed * work.step
        last = allowed == 1.0 and ahead == 1.0 - done
        if last:
            for i in range(len(system.held)):
                motion[system.held[i]] = load[i]
        before = counts[FACTORS]
        wanted = relative if last else ON_THE_WAY
        if usable and _correct(motion, wanted, absolute, system, work, trial, counts):
            done = 1.0 if last else done + allowed * ahead
            if counts[FACTORS] - before <= 5:
                increment = min(1.0, 2.0 * increment)
        else:
            motion[:] = saved
            increment = 0.25 * allowed * ahead
            if increment < SMALLEST_INCREMENT:
                return done, increment
    return done, increment


@compiled
def follow(
    loads: Floats, system: System, relative: float, absolute: float, states: Floats, stable: Ints,
    counts: Ints,
) -> tuple[int, float]:  # fmt: skip
    """Fills ``states`` (n_loads, n_dofs) with the equilibria at ``loads`` (n_loads, n_held).

    ``stable`` (n_loads,) tells whether the tangent there is positive definite; ``counts`` (4,)
    gathers the work.

    Returns:
        the number of loads reached, and the fraction of the way to the next.
    """
    work = workspace(system)
    motion = np.zeros(len(system.mass))
    saved, trial = np.empty_like(motion), np.empty_like(motion)
    # rest itself may be out of balance: a void may start in contact
    if not _correct(motion, relative, absolute, system, work, trial, counts):
        return 0, 0.0
    increment = 1.0
    for p in range(len(loads)):
        done, increment = _advance(
            motion, loads[p], relative, absolute, increment, system, work, saved, trial, counts
        )
        states[p] = motion
        if done < 1.0:
            return p, done
        counts[FACTORS] += 1
        stable[p] = _factorise(motion, system, work, 0.0)
    return len(loads), 0.0


@compiled
def adjoint(states: Floats, bar: Floats, system: System, which: Ints, bars: Bars) -> int:
    """Adds the derivatives of a loss with derivatives ``bar`` (n_loads, n_dofs) by ``states``.

    Returns:
        the first load whose tangent is not positive definite, or -1.
    """
    work = workspace(system)
    for p in range(len(states)):
        if np.abs(bar[p]).max() == 0.0:
            continue
        if not _factorise(states[p], system, work, 0.0):
            return p
        work.force[:] = bar[p]
        _solve_free(system, work, -1.0)
        mixed(states[p], system, work.turn, work.step, which, bars.sensitivity)
        hessian_product(states[p], system, work.turn, work.step, work.product)
        for i in range(len(system.held)):
            bars.drive[p, i] += work.product[system.held[i]]
    return -1
