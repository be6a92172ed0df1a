"""Compiled explicit integration of a network's motion and its exact discrete adjoint.

A step alternates drifts u += a h v and kicks, which solve M v' = -dE/dq - C v exactly for frozen u:

    v' = decay v - gain dE/dq,   decay = exp(-b h C / M),   gain = (1 - decay) / C.

The reverse sweep needs the states at the kicks; they are kept at checkpoints and computed again
segment by segment, so memory grows with the square root of the number of steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.arrays import Floats, Ints
from sim.compiling import compiled
from sim.potential import gradient, hessian_product, mixed
from sim.system import Bars, System, Workspace, workspace


class Steps(NamedTuple):
    """Equal steps of a splitting.

    Attributes:
        n_steps: number of steps.
        h: step, s.
        drifts: (n_kicks + 1,) coefficients.
        decay, gain: (n_kicks, n_dofs) of the kicks.
        drive: (n_steps, n_kicks, n_held) prescribed values at the kicks.
        segment: steps between checkpoints.
    """

    n_steps: int
    h: float
    drifts: Floats
    decay: Floats
    gain: Floats
    drive: Floats
    segment: int


class Outputs(NamedTuple):
    """Interpolation of the outputs between the ends of a step.

    Attributes:
        interval: (n_asked,) step in which each output lies, ascending.
        values: (n_asked, 4) weights of (u, u', v, v') in the displacement.
        rates: (n_asked, 4) the same in the velocity.
    """

    interval: Ints
    values: Floats
    rates: Floats


@compiled
def _step(
    n: int, u: Floats, v: Floats, steps: Steps, system: System, work: Workspace, kept_u: Floats,
    kept_v: Floats,
) -> float:  # fmt: skip
    """Advances ``u``, ``v`` (n_dofs,) by step ``n``; keeps the states just before its kicks.

    Returns:
        the sum of the energies at the kicks: not finite once a void is beyond its barrier.
    """
    total = 0.0
    for m in range(len(steps.gain)):
        for d in system.dofs:
            u[d] += steps.drifts[m] * steps.h * v[d]
        for i in range(len(system.held)):
            u[system.held[i]] = steps.drive[n, m, i]
        kept_u[m] = u
        kept_v[m] = v
        strain, contact = gradient(u, system, work.turn, work.force)
        total += strain + contact
        for d in system.dofs:
            v[d] = steps.decay[m, d] * v[d] - steps.gain[m, d] * work.force[d]
    for d in system.dofs:
        u[d] += steps.drifts[len(steps.gain)] * steps.h * v[d]
    return total


@compiled
def run(
    steps: Steps,
    outputs: Outputs,
    system: System,
    checkpoints: Floats,
    out_u: Floats,
    out_v: Floats,
) -> int:
    """Integrates from rest; fills outputs (n_asked, n_dofs) and checkpoints.

    Checkpoints are (n_segments, 2, n_dofs) displacement and velocity.

    Returns:
        the step at which the motion left the admissible states, or -1.
    """
    n_kicks, n_dofs = steps.gain.shape
    work = workspace(system)
    u, v = np.zeros(n_dofs), np.zeros(n_dofs)
    last_u, last_v = np.zeros(n_dofs), np.zeros(n_dofs)
    kept_u, kept_v = np.empty((n_kicks, n_dofs)), np.empty((n_kicks, n_dofs))
    asked = 0
    for n in range(steps.n_steps):
        if n % steps.segment == 0:
            checkpoints[n // steps.segment, 0] = u
            checkpoints[n // steps.segment, 1] = v
        last_u[:] = u
        last_v[:] = v
        if not np.isfinite(_step(n, u, v, steps, system, work, kept_u, kept_v)):
            return n
        while asked < len(outputs.interval) and outputs.interval[asked] == n:
            w, r = outputs.values[asked], outputs.rates[asked]
            out_u[asked] = w[0] * last_u + w[1] * u + w[2] * last_v + w[3] * v
            out_v[asked] = r[0] * last_u + r[1] * u + r[2] * last_v + r[3] * v
            asked += 1
    return -1


@compiled
def _step_back(
    n: int, v: Floats, bar_u: Floats, bar_v: Floats, kept_u: Floats, kept_v: Floats, steps: Steps,
    system: System, work: Workspace, which: Ints, bars: Bars, bar_decay: Floats, bar_gain: Floats,
) -> None:  # fmt: skip
    """Takes derivatives by the end of step ``n`` to its start, and its velocity ``v`` with them."""
    n_kicks = len(steps.gain)
    for m in range(n_kicks - 1, -1, -1):
        work.step[:] = 0.0
        for d in system.dofs:
            bar_v[d] += steps.drifts[m + 1] * steps.h * bar_u[d]
            gain, before = steps.gain[m, d], kept_v[m, d]
            work.step[d] = -gain * bar_v[d]
            bar_decay[m, d] += bar_v[d] * before
            bar_gain[m, d] -= bar_v[d] * (steps.decay[m, d] * before - v[d]) / gain
            bar_v[d] *= steps.decay[m, d]
            v[d] = before
        hessian_product(kept_u[m], system, work.turn, work.step, work.product)
        mixed(kept_u[m], system, work.turn, work.step, which, bars.sensitivity)
        for d in system.dofs:
            bar_u[d] += work.product[d]
        for i in range(len(system.held)):
            bars.drive[n, m, i] += work.product[system.held[i]]
    for d in system.dofs:
        bar_v[d] += steps.drifts[0] * steps.h * bar_u[d]


@compiled
def sweep_back(
    steps: Steps, outputs: Outputs, system: System, checkpoints: Floats, out_bar_u: Floats,
    out_bar_v: Floats, which: Ints, bars: Bars, bar_decay: Floats, bar_gain: Floats,
) -> None:  # fmt: skip
    """Reverse sweep of ``run`` from the loss derivatives by its outputs (n_asked, n_dofs).

    Adds to ``bars`` but for mass and damping, which enter through ``bar_decay`` and ``bar_gain``.
    """
    n_kicks, n_dofs = steps.gain.shape
    work = workspace(system)
    kept_u = np.empty((steps.segment, n_kicks, n_dofs))
    kept_v = np.empty((steps.segment, n_kicks, n_dofs))
    u, v = np.empty(n_dofs), np.empty(n_dofs)
    bar_u, bar_v = np.zeros(n_dofs), np.zeros(n_dofs)
    left_u, left_v = np.zeros(n_dofs), np.zeros(n_dofs)
    asked = len(outputs.interval) - 1
    for part in range((steps.n_steps - 1) // steps.segment, -1, -1):
        start = part * steps.segment
        count = min(steps.segment, steps.n_steps - start)
        u[:] = checkpoints[part, 0]
        v[:] = checkpoints[part, 1]
        for n in range(count):
            _step(start + n, u, v, steps, system, work, kept_u[n], kept_v[n])
        for n in range(count - 1, -1, -1):
            bar_u += left_u
            bar_v += left_v
            left_u[:] = 0.0
            left_v[:] = 0.0
            while asked >= 0 and outputs.interval[asked] == start + n:
                w, r = outputs.values[asked], outputs.rates[asked]
                left_u += w[0] * out_bar_u[asked] + r[0] * out_bar_v[asked]
                bar_u += w[1] * out_bar_u[asked] + r[1] * out_bar_v[asked]
                left_v += w[2] * out_bar_u[asked] + r[2] * out_bar_v[asked]
                bar_v += w[3] * out_bar_u[asked] + r[3] * out_bar_v[asked]
                asked -= 1
            _step_back(start + n, v, bar_u, bar_v, kept_u[n], kept_v[n], steps, system, work,
                       which, bars, bar_decay, bar_gain)  # fmt: skip
