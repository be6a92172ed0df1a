"""Integrates a network's motion explicitly, with its exact discrete adjoint; compiled.

A step alternates flights and kicks. A flight of length a h is free but for the barriers of closed
voids (sim/time_integration/contact_substeps.py); a kick solves, for frozen u and the energy E of
all else,

    v' = decay v - gain dE/dq,   decay = exp(-b h C / M),   gain = (1 - decay) / C.

The reverse sweep needs the states at the kicks; they are kept at checkpoints and computed again
segment by segment, so memory grows with the square root of the number of steps.
"""

from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import (
    Bars,
    Kinematics,
    System,
    Workspace,
    gradient,
    hessian_product,
    mixed,
)
from sim.time_integration.contact_substeps import Flight, Pace, flight_of, fly, fly_back


class Steps(NamedTuple):
    """Equal steps of a splitting."""

    n_steps: int  # number of steps
    h: float  # step, s
    pace: Pace  # coefficients of the flights, and of the finer steps within them
    decay: Floats  # (n_kicks, n_dofs) of the kicks
    gain: Floats  # (n_kicks, n_dofs) of the kicks
    drive: Floats  # (n_steps, n_kicks, n_held) prescribed values at the kicks
    segment: int  # steps between checkpoints


class Outputs(NamedTuple):
    """Interpolation of the outputs between the ends of a step."""

    interval: Ints  # (n_times,) step in which each output lies, ascending
    values: Floats  # (n_times, 4) weights of (u, u', v, v') in the displacement
    rates: Floats  # (n_times, 4) the same in the velocity


class Trace(NamedTuple):
    """States within some steps, for the reverse sweep: step ``n`` is at ``n % len(u)``."""

    # u, v: (n, n_kicks + 1, n_dofs) where the flights start, that is at and after the kicks
    u: Floats
    v: Floats
    before: Floats  # (n, n_kicks, n_dofs) velocities before the kicks
    turn: Floats  # (n, n_kicks, n_units, 4) of the kinematics at the kicks
    shear: Floats  # (n, n_kicks, n_ligaments) likewise


@inlined
def _trace(n: int, steps: Steps, system: System) -> Trace:
    n_kicks, n_dofs = steps.gain.shape
    return Trace(
        np.empty((n, n_kicks + 1, n_dofs)),
        np.empty((n, n_kicks + 1, n_dofs)),
        np.empty((n, n_kicks, n_dofs)),
        np.empty((n, n_kicks, n_dofs // 3, 4)),
        np.empty((n, n_kicks, len(system.net.unit))),
    )


@inlined
def _hold(n: int, m: int, u: Floats, steps: Steps, system: System) -> None:
    """Sets the held dofs for flight ``m`` of step ``n``: between the kicks before and after it."""
    last, following = max(m - 1, 0), min(m, len(steps.gain) - 1)
    for i in range(len(system.held)):
        u[system.held[i]] = 0.5 * (steps.drive[n, last, i] + steps.drive[n, following, i])


@compiled
def _step(
    n: int, u: Floats, v: Floats, steps: Steps, system: System, work: Workspace, flight: Flight,
    trace: Trace,
) -> float:  # fmt: skip
    """Advances ``u``, ``v`` (n_dofs,) by step ``n``; keeps its states in ``trace``.

    Returns:
        the sum of the energies at the kicks: not finite once a void is beyond its barrier.
    """
    total, n_kicks, slot = 0.0, len(steps.gain), n % len(trace.u)
    for m in range(n_kicks + 1):
        trace.u[slot, m] = u
        trace.v[slot, m] = v
        _hold(n, m, u, steps, system)
        if fly(steps.pace.drifts[m] * steps.h, u, v, steps.pace, system, flight) < 0:
            return np.inf
        if m < n_kicks:
            trace.before[slot, m] = v
            for i in range(len(system.held)):
                u[system.held[i]] = steps.drive[n, m, i]
            kinematics = Kinematics(trace.turn[slot, m], trace.shear[slot, m])
            strain, contact = gradient(u, system, kinematics, work.force)
            total += strain + contact
            for d in system.dofs:  # v+ = e v- - g dW/du: the exact flow of M v' + C v = -dW/du
                v[d] = steps.decay[m, d] * v[d] - steps.gain[m, d] * work.force[d]
    return total


@compiled
def run(
    steps: Steps,
    outputs: Outputs,
    system: System,
    work: Workspace,
    watched: Ints,
    checkpoints: Floats,
    out_u: Floats,
    out_v: Floats,
) -> int:
    """Integrates from rest; fills outputs (n_times, n_dofs) and checkpoints.

    Checkpoints are (n_segments, 2, n_dofs) displacement and velocity. Contact of ``watched`` voids
    is that of the flights; the system must have none of its own.

    Returns:
        the step at which the motion left the admissible states, or -1.
    """
    n_dofs = steps.gain.shape[1]
    flight = flight_of(watched, n_dofs // 3)
    trace = _trace(1, steps, system)
    u, v = np.zeros(n_dofs), np.zeros(n_dofs)
    last_u, last_v = np.zeros(n_dofs), np.zeros(n_dofs)
    output = 0
    for n in range(steps.n_steps):
        if n % steps.segment == 0:
            checkpoints[n // steps.segment, 0] = u
            checkpoints[n // steps.segment, 1] = v
        last_u[:] = u
        last_v[:] = v
        if not np.isfinite(_step(n, u, v, steps, system, work, flight, trace)):
            return n
        while output < len(outputs.interval) and outputs.interval[output] == n:
            w, r = outputs.values[output], outputs.rates[output]
            out_u[output] = w[0] * last_u + w[1] * u + w[2] * last_v + w[3] * v
            out_v[output] = r[0] * last_u + r[1] * u + r[2] * last_v + r[3] * v
            output += 1
    return -1


@inlined
def _flight_back(
    n: int, m: int, u: Floats, v: Floats, bar_u: Floats, bar_v: Floats, steps: Steps,
    system: System, flight: Flight, bars: Bars,
) -> None:  # fmt: skip
    """Takes derivatives by the end of flight ``m`` of step ``n`` to its start ``u``, ``v``."""
    _hold(n, m, u, steps, system)
    fly_back(
        steps.pace.drifts[m] * steps.h, u, v, bar_u, bar_v, steps.pace, system, flight,
        bars.sensitivity, bars.mass,
    )  # fmt: skip
    last, following = max(m - 1, 0), min(m, len(steps.gain) - 1)
    for i in range(len(system.held)):
        unit = system.held[i] // 3
        if system.held[i] % 3 == 2 and flight.met[unit] == 1:
            bars.drive[n, last, i] += 0.5 * flight.pull[unit]
            bars.drive[n, following, i] += 0.5 * flight.pull[unit]


@inlined
def _kick_back(
    n: int, m: int, bar_u: Floats, bar_v: Floats, trace: Trace, steps: Steps, system: System,
    work: Workspace, which: Ints, bars: Bars, bar_decay: Floats, bar_gain: Floats,
) -> None:  # fmt: skip
    """Takes derivatives by the velocities after kick ``m`` of step ``n`` to those before it."""
    slot = n % len(trace.u)
    work.step[:] = 0.0
    for d in system.dofs:
        gain, before = steps.gain[m, d], trace.before[slot, m, d]
        work.step[d] = -gain * bar_v[d]
        bar_decay[m, d] += bar_v[d] * before
        bar_gain[m, d] -= bar_v[d] * (steps.decay[m, d] * before - trace.v[slot, m + 1, d]) / gain
        bar_v[d] *= steps.decay[m, d]
    u, kinematics = trace.u[slot, m + 1], Kinematics(trace.turn[slot, m], trace.shear[slot, m])
    hessian_product(u, system, kinematics, work.step, work.product)
    mixed(u, system, kinematics, work.step, which, bars.sensitivity)
    for d in system.dofs:
        bar_u[d] += work.product[d]
    for i in range(len(system.held)):
        bars.drive[n, m, i] += work.product[system.held[i]]


@inlined
def _step_back(
    n: int, bar_u: Floats, bar_v: Floats, trace: Trace, steps: Steps, system: System,
    work: Workspace, flight: Flight, which: Ints, bars: Bars, bar_decay: Floats, bar_gain: Floats,
) -> None:  # fmt: skip
    """Takes derivatives by the end of step ``n`` to its start."""
    slot = n % len(trace.u)
    for m in range(len(steps.gain), -1, -1):
        work.trial[:] = trace.u[slot, m]
        work.saved[:] = trace.v[slot, m]
        _flight_back(
            n, m, work.trial, work.saved, bar_u, bar_v, steps, system, flight, bars
        )  # fmt: skip
        if m > 0:
            _kick_back(n, m - 1, bar_u, bar_v, trace, steps, system, work, which, bars,
                       bar_decay, bar_gain)  # fmt: skip


@compiled
def sweep_back(
    steps: Steps, outputs: Outputs, system: System, work: Workspace, watched: Ints,
    checkpoints: Floats, out_bar_u: Floats, out_bar_v: Floats, which: Ints, bars: Bars,
    bar_decay: Floats, bar_gain: Floats,
) -> None:  # fmt: skip
    """Reverse sweep of ``run`` from the loss derivatives by its outputs (n_times, n_dofs).

    Adds to ``bars``, but for damping and what mass does to the kicks: these enter through
    ``bar_decay`` and ``bar_gain``.
    """
    n_dofs = steps.gain.shape[1]
    flight = flight_of(watched, n_dofs // 3)
    trace = _trace(steps.segment, steps, system)
    u, v = np.empty(n_dofs), np.empty(n_dofs)
    bar_u, bar_v = np.zeros(n_dofs), np.zeros(n_dofs)
    left_u, left_v = np.zeros(n_dofs), np.zeros(n_dofs)
    output = len(outputs.interval) - 1
    for part in range((steps.n_steps - 1) // steps.segment, -1, -1):
        start = part * steps.segment
        count = min(steps.segment, steps.n_steps - start)
        u[:] = checkpoints[part, 0]
        v[:] = checkpoints[part, 1]
        for n in range(count):
            _step(start + n, u, v, steps, system, work, flight, trace)
        for n in range(count - 1, -1, -1):
            bar_u += left_u
            bar_v += left_v
            left_u[:] = 0.0
            left_v[:] = 0.0
            while output >= 0 and outputs.interval[output] == start + n:
                w, r = outputs.values[output], outputs.rates[output]
                left_u += w[0] * out_bar_u[output] + r[0] * out_bar_v[output]
                bar_u += w[1] * out_bar_u[output] + r[1] * out_bar_v[output]
                left_v += w[2] * out_bar_u[output] + r[2] * out_bar_v[output]
                bar_v += w[3] * out_bar_u[output] + r[3] * out_bar_v[output]
                output -= 1
            _step_back(start + n, bar_u, bar_v, trace, steps, system, work, flight, which, bars,
                       bar_decay, bar_gain)  # fmt: skip
