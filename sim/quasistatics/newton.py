"""Descends to an equilibrium at fixed held dofs by Newton's method, compiled.

Every step descends the energy and stops short of the contact barrier. An indefinite tangent is
shifted until it is positive definite, so that the descent ends in a minimum or, rarely, exactly on
a saddle.
"""

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import System, Workspace, admissible_step, gradient, locate, tangent
from sim.linalg import add, clear, factorise, solve

KEEP_FROM_BARRIER = 0.9
MAX_CORRECTIONS = 200
MAX_BACKTRACKS = 30
MAX_SHIFTS = 40
FIRST_SHIFT = 1e-4
"""Of an indefinite tangent, over the median axial stiffness: a few ligaments may be far stiffer."""
SMALLER_SHIFT = 0.125
"""Over the last one that did, where the next trial of shifts begins."""
KEEP_FACTOR, RENEW_FACTOR = 1e-2, 0.1
"""A step that reduces the residual by more than the one has a factor worth keeping, until a step
reduces it by less than the other."""

GRADIENTS, FACTORS, SHIFTED, INCREMENTS = 0, 1, 2, 3
"""Places in the counts that the solvers gather."""


@compiled
def balance(motion: Floats, system: System, work: Workspace) -> tuple[float, float, float]:
    """Energy, and the largest out-of-balance and reaction force (moments over the scale), N."""
    strain, contact = gradient(motion, system, work.kinematics, work.force)
    residual, reaction = 0.0, 0.0
    for d in system.dofs:
        residual = max(residual, abs(work.force[d]) / system.scale[d])
    for d in system.held:
        reaction = max(reaction, abs(work.force[d]) / system.scale[d])
    return strain + contact, residual, reaction


@compiled
def factorise_tangent(
    motion: Floats, system: System, work: Workspace, shift: float, counts: Ints
) -> bool:
    """Factor of the (shifted) tangent; False if it is not positive definite."""
    counts[FACTORS] += 1
    clear(work.matrix)
    locate(motion, system, work.kinematics)
    tangent(motion, system, work.kinematics, work.matrix)
    if shift > 0.0:
        for i in range(len(system.dofs)):
            add(work.matrix, i, i, shift * system.scale[system.dofs[i]] ** 2)
    return factorise(work.matrix)


@compiled
def _factorise(
    motion: Floats, system: System, work: Workspace, first: float, counts: Ints
) -> float:
    """Factor of the tangent, shifted by ``first`` or more if need be; returns the shift.

    It is negative if none helped.
    """
    shift = 0.0
    for tries in range(MAX_SHIFTS):
        if factorise_tangent(motion, system, work, shift, counts):
            return shift
        if tries == 0:
            counts[SHIFTED] += 1
            shift = first
        else:
            shift *= 4.0
    return -1.0


@compiled
def factorise_shifted(motion: Floats, system: System, work: Workspace, counts: Ints) -> float:
    """Factor of the tangent, shifted if need be; returns the shift, negative if none helped."""
    return _factorise(motion, system, work, _first_shift(system), counts)


@inlined
def _first_shift(system: System) -> float:
    return FIRST_SHIFT * float(np.median(system.net.law[:, 0]))


@compiled
def solve_free(system: System, work: Workspace) -> None:
    """Fills ``work.step`` with what takes the force off the free dofs, by the tangent's factor."""
    for i in range(len(system.dofs)):
        work.right[i] = -work.force[system.dofs[i]]
    solve(work.matrix, work.right)
    for d in system.held:
        work.step[d] = 0.0
    for i in range(len(system.dofs)):
        work.step[system.dofs[i]] = work.right[i]


@compiled
def _descend(
    motion: Floats, energy: float, residual: float, newton: bool, system: System, work: Workspace,
    counts: Ints,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Moves ``motion`` along ``work.step`` by backtracking short of the barrier.

    A full Newton step that halves the residual passes too: near the end the energy is all rounding.

    Returns:
        length of the step, 0 if none was found, and energy, residual and reaction there.
    """
    slope = 0.0
    for d in system.dofs:
        slope += work.step[d] * work.force[d]
    length = min(1.0, KEEP_FROM_BARRIER * admissible_step(motion, system, work.step))
    for _ in range(MAX_BACKTRACKS):
        work.trial[:] = motion + length * work.step
        new_energy, new_residual, reaction = balance(work.trial, system, work)
        counts[GRADIENTS] += 1
        descends = new_energy <= energy + 1e-4 * length * slope
        if np.isfinite(new_energy) and (descends or (newton and new_residual < 0.5 * residual)):
            motion[:] = work.trial
            return length, new_energy, new_residual, reaction
        length *= 0.5
    return 0.0, energy, residual, 0.0


@compiled
def correct(
    motion: Floats, relative: float, absolute: float, shifted: bool, system: System,
    work: Workspace, counts: Ints,
) -> bool:  # fmt: skip
    """Newton descent at fixed held dofs; True once the residual is below its tolerance.

    Unless tangents may be ``shifted``, it gives up at the first that is indefinite.
    """
    energy, residual, reaction = balance(motion, system, work)
    counts[GRADIENTS] += 1
    keep, shift, first = False, 0.0, _first_shift(system)
    for _ in range(MAX_CORRECTIONS):
        if residual <= max(relative * reaction, absolute):
            return True
        if not (keep or shifted):
            if not factorise_tangent(motion, system, work, 0.0, counts):
                return False
        elif not keep:
            shift = _factorise(motion, system, work, first, counts)
            if shift < 0.0:
                return False
            if shift > 0.0:  # the smallest that does leads furthest
                first = SMALLER_SHIFT * shift
        solve_free(system, work)
        before = residual
        length, energy, residual, reaction = _descend(
            motion, energy, residual, shift == 0.0, system, work, counts
        )
        if length == 0.0:
            if not keep:
                return False
            energy, residual, reaction = balance(motion, system, work)
        limit = RENEW_FACTOR if keep else KEEP_FACTOR
        keep = shift == 0.0 and length == 1.0 and residual < limit * before
    return False
