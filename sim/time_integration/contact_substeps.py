"""Moves the units between two kicks, with contact on void angles, and back; compiled.

Units fly straight on but where a void is closed to its cutoff: there the barrier turns them back,
the faster the deeper they are. This part of the motion is local and needs no ligament's force, so
the rotations of those units take finer steps of the same splitting, as many as the depth asks for
that their energy can carry them to. The steps of all else need not follow the barrier.
"""

import math
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints, compiled, inlined
from sim.energy import Sensitivity, System, void_slopes

MARGIN = math.radians(2.0)
"""Voids that may come as near as this to their cutoff during a flight are followed in it."""

SHARED = 2.0
"""Stiffness of voids that share units, over that of one alone."""

MOST = 4096
"""Finer steps of one flight at most."""


class Pace(NamedTuple):
    """Holds the splitting of the finer steps."""

    drifts: Floats  # its coefficients
    kicks: Floats  # its coefficients
    reach: float  # longest finer step times the angular frequency of the barrier


class Flight(NamedTuple):
    """Scratch of one flight."""

    watched: Ints  # (n_watched,) ligaments whose voids may come to contact
    near: Ints  # (n_watched,) those that do in this flight
    units: Ints  # (n_units,) the units that these join
    met: Ints  # (n_units,) whether a unit is among them
    angle: Floats  # (n_units,) rotations at the start
    rate: Floats  # (n_units,) their rates
    force: Floats  # (n_units,) moments
    pull: Floats  # (n_units,) derivatives by held rotations
    found: Ints  # (2,) numbers of voids near and of units


@compiled
def flight_of(watched: Ints, n_units: int) -> Flight:
    """Scratch for flights of a structure."""
    return Flight(
        watched, np.empty_like(watched), np.empty(n_units, np.int64), np.zeros(n_units, np.int64),
        np.empty(n_units), np.empty(n_units), np.zeros(n_units), np.zeros(n_units),
        np.zeros(2, np.int64),
    )  # fmt: skip


@inlined
def _find(tau: float, u: Floats, v: Floats, system: System, flight: Flight) -> None:
    """Notes the voids that may come to contact within ``tau``, and the units beside them."""
    net, n_near, n_units = system.net, 0, 0
    for i in range(flight.found[1]):
        flight.met[flight.units[i]] = 0
    for k in flight.watched:
        a, b = net.unit[k, 0], net.unit[k, 1]
        turn = u[3 * a + 2] - u[3 * b + 2]
        turning = tau * (v[3 * a + 2] - v[3 * b + 2])
        one, other = net.void[k, 0] + turn, net.void[k, 1] - turn
        if min(one + min(turning, 0.0), other - max(turning, 0.0)) < net.contact[k, 2] + MARGIN:
            flight.near[n_near] = k
            n_near += 1
            for unit in (a, b):
                if flight.met[unit] == 0:
                    flight.met[unit] = 1
                    flight.units[n_units] = unit
                    flight.angle[unit], flight.rate[unit] = u[3 * unit + 2], v[3 * unit + 2]
                    n_units += 1
    flight.found[0], flight.found[1] = n_near, n_units


@compiled
def _agility(unit: int, system: System) -> float:
    """Reciprocal rotational inertia of a unit, zero if its rotation is held."""
    return 1.0 / system.mass[3 * unit + 2] if system.free[3 * unit + 2] >= 0 else 0.0


@inlined
def _finer_steps(tau: float, pace: Pace, system: System, flight: Flight) -> int:
    """Counts the finer steps that follow the barrier where the energy of each void can carry it."""
    net, fastest = system.net, 0.0
    for i in range(flight.found[0]):
        k = flight.near[i]
        a, b = net.unit[k, 0], net.unit[k, 1]
        agility = _agility(a, system) + _agility(b, system)
        if agility > 0.0:
            turn, rate = flight.angle[a] - flight.angle[b], flight.rate[a] - flight.rate[b]
            energy = 0.5 * rate * rate / agility
            for side in range(2):
                energy += void_slopes(net, k, side, turn)[0]
            stiffness, barrier, cutoff = net.contact[k]
            scale = 0.5 * stiffness * (cutoff - barrier) ** 2
            rest = scale / (scale + energy)
            curvature = 0.5 * stiffness * (8.0 - 6.0 * rest) / rest**3
            fastest = max(fastest, SHARED * curvature * agility)
    steps = abs(tau) * math.sqrt(fastest) / pace.reach
    return math.ceil(max(steps, 1.0)) if steps <= MOST else MOST + 1


@inlined
def _moments(u: Floats, system: System, flight: Flight) -> bool:
    """Fills the moments of the barriers on the units that meet; whether none is passed."""
    net = system.net
    for i in range(flight.found[1]):
        flight.force[flight.units[i]] = 0.0
    for i in range(flight.found[0]):
        k = flight.near[i]
        a, b = net.unit[k, 0], net.unit[k, 1]
        for side in range(2):
            energy, slope, _ = void_slopes(net, k, side, u[3 * a + 2] - u[3 * b + 2])
            if not energy < np.inf:
                return False
            flight.force[a] += slope
            flight.force[b] -= slope
    return True


@compiled
def _turn(tau: float, u: Floats, v: Floats, flight: Flight) -> None:
    for i in range(flight.found[1]):
        d = 3 * flight.units[i] + 2
        u[d] += tau * v[d]


@inlined
def _push(tau: float, v: Floats, system: System, flight: Flight) -> None:
    for i in range(flight.found[1]):
        unit = flight.units[i]
        v[3 * unit + 2] -= tau * _agility(unit, system) * flight.force[unit]


@inlined
def _bounce(
    tau: float, n: int, u: Floats, v: Floats, pace: Pace, system: System, flight: Flight
) -> bool:
    """Takes the units that meet through ``n`` finer steps; whether no barrier is passed."""
    for i in range(flight.found[1]):
        unit = flight.units[i]
        u[3 * unit + 2], v[3 * unit + 2] = flight.angle[unit], flight.rate[unit]
    delta = tau / n
    for _ in range(n):
        for m in range(len(pace.kicks)):
            _turn(pace.drifts[m] * delta, u, v, flight)
            if not _moments(u, system, flight):
                return False
            _push(pace.kicks[m] * delta, v, system, flight)
        _turn(pace.drifts[-1] * delta, u, v, flight)
    return True


@compiled
def fly(tau: float, u: Floats, v: Floats, pace: Pace, system: System, flight: Flight) -> int:
    """Advances ``u`` and ``v`` (n_dofs,) by ``tau`` under the voids' barriers and nothing else.

    Held dofs stay where they are and count as at rest.

    Returns:
        the number of finer steps taken by the units that met, or -1 if they pass a barrier.
    """
    _find(tau, u, v, system, flight)
    for d in system.dofs:
        u[d] += tau * v[d]
    if flight.found[0] == 0:
        return 0
    n = _finer_steps(tau, pace, system, flight)
    while n <= MOST:
        if _bounce(tau, n, u, v, pace, system, flight):
            return n
        n *= 2
    return -1


@inlined
def _pull(
    weight: float, u: Floats, bar_u: Floats, bar_v: Floats, system: System, flight: Flight,
    out: Sensitivity, by_mass: Floats,
) -> None:  # fmt: skip
    """Reverse of ``_push`` at the moments held in ``flight``."""
    net = system.net
    for i in range(flight.found[1]):
        unit = flight.units[i]
        agility, bar = _agility(unit, system), bar_v[3 * unit + 2]
        by_mass[3 * unit + 2] += weight * agility * agility * flight.force[unit] * bar
    for i in range(flight.found[0]):
        k = flight.near[i]
        a, b = net.unit[k, 0], net.unit[k, 1]
        turning = -weight * (
            _agility(a, system) * bar_v[3 * a + 2] - _agility(b, system) * bar_v[3 * b + 2]
        )
        for side in range(2):
            _, slope, curvature = void_slopes(net, k, side, u[3 * a + 2] - u[3 * b + 2])
            moment = curvature * turning
            out.void[k, side] += (1.0 - 2.0 * side) * moment
            out.contact[k] += slope / net.contact[k, 0] * turning
            bar_u[3 * a + 2] += moment
            bar_u[3 * b + 2] -= moment


@inlined
def _bounce_back(
    tau: float, n: int, u: Floats, v: Floats, bar_u: Floats, bar_v: Floats, pace: Pace,
    system: System, flight: Flight, out: Sensitivity, by_mass: Floats,
) -> None:  # fmt: skip
    """Reverse of ``_bounce`` from its end; the states come back as they went, to rounding."""
    delta = tau / n
    for _ in range(n):
        for m in range(len(pace.kicks), -1, -1):
            drift = pace.drifts[m] * delta
            for i in range(flight.found[1]):
                d = 3 * flight.units[i] + 2
                if system.free[d] >= 0:
                    bar_v[d] += drift * bar_u[d]
            _turn(-drift, u, v, flight)
            if m > 0:
                kick = pace.kicks[m - 1] * delta
                _moments(u, system, flight)
                _push(-kick, v, system, flight)
                _pull(kick, u, bar_u, bar_v, system, flight, out, by_mass)


@compiled
def fly_back(
    tau: float, u: Floats, v: Floats, bar_u: Floats, bar_v: Floats, pace: Pace, system: System,
    flight: Flight, out: Sensitivity, by_mass: Floats,
) -> None:  # fmt: skip
    """Takes derivatives by the end of a flight to its start, which is given in ``u`` and ``v``.

    ``flight.pull`` receives those by the rotations of held units; ``u`` and ``v`` are overwritten.
    """
    n = fly(tau, u, v, pace, system, flight)
    for i in range(flight.found[1]):
        unit = flight.units[i]
        if system.free[3 * unit + 2] < 0:
            bar_u[3 * unit + 2] = 0.0
    for d in system.dofs:
        if n == 0 or d % 3 != 2 or flight.met[d // 3] == 0:
            bar_v[d] += tau * bar_u[d]
    if n > 0:
        _bounce_back(tau, n, u, v, bar_u, bar_v, pace, system, flight, out, by_mass)
    for i in range(flight.found[1]):
        unit = flight.units[i]
        if system.free[3 * unit + 2] < 0:
            flight.pull[unit] = bar_u[3 * unit + 2]
