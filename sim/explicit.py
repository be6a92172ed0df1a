"""Compiled explicit integration of a network's motion and its exact discrete adjoint.

A step alternates drifts u += a h v and kicks, which solve M v' = -dE/dq - C v exactly for frozen u:

    v' = decay v - gain dE/dq,   decay = exp(-b h C / M),   gain = (1 - decay) / C.

The reverse sweep needs the states at the kicks; they are kept at checkpoints and computed again
segment by segment, so memory grows with the square root of the number of steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse.linalg as spla

from sim import grid
from sim.arrays import Floats, Ints
from sim.dynamics import Drive, as_parameters, empty_sensitivity
from sim.errors import SimulationError
from sim.kernels import (
    Network,
    Sensitivity,
    compiled,
    gradient,
    hessian_product,
    mixed,
    smallest_void,
)
from sim.model import Topology, Values
from sim.splitting import BLANES_MOAN, Splitting

MAX_HALVINGS = 6
WATCH_EVERY = 8


@compiled
def _step(
    u: Floats,
    v: Floats,
    h: float,
    drifts: Floats,
    decay: Floats,
    gain: Floats,
    drive: Floats,
    net: Network,
    dofs: Ints,
    held: Ints,
    turn: Floats,
    force: Floats,
    kept_u: Floats,
    kept_v: Floats,
) -> None:
    """Advances ``u``, ``v`` (n_dofs,) by one step; keeps the states just before its kicks."""
    for m in range(len(gain)):
        for i in range(len(dofs)):
            u[dofs[i]] += drifts[m] * h * v[dofs[i]]
        for i in range(len(held)):
            u[held[i]] = drive[m, i]
        kept_u[m] = u
        kept_v[m] = v
        gradient(u, net, turn, force)
        for i in range(len(dofs)):
            d = dofs[i]
            v[d] = decay[m, d] * v[d] - gain[m, d] * force[d]
    for i in range(len(dofs)):
        u[dofs[i]] += drifts[len(gain)] * h * v[dofs[i]]


@compiled
def run(
    n_steps: int,
    h: float,
    drifts: Floats,
    decay: Floats,
    gain: Floats,
    drive: Floats,
    net: Network,
    dofs: Ints,
    held: Ints,
    segment: int,
    interval: Ints,
    values: Floats,
    rates: Floats,
    checkpoints: Floats,
    out_u: Floats,
    out_v: Floats,
) -> int:
    """Integrates from rest; fills the asked outputs and the checkpoints.

    Args:
        drive: (n_steps, n_kicks, n_held) prescribed values at the kicks.
        segment: steps between checkpoints.
        interval: (n_asked,) step in which each output lies, ascending.
        values, rates: (n_asked, 4) weights of (u, u', v, v') at the step's ends in displacement and
            velocity.
        checkpoints: (n_segments, 2, n_dofs) displacement and velocity.
        out_u, out_v: (n_asked, n_dofs).

    Returns:
        the step at which the motion left the admissible states, or -1.
    """
    n_kicks, n_dofs = gain.shape
    turn, force = np.empty((n_dofs // 3, 4)), np.empty(n_dofs)
    u, v, last_u, last_v = np.zeros(n_dofs), np.zeros(n_dofs), np.zeros(n_dofs), np.zeros(n_dofs)
    kept_u, kept_v = np.empty((n_kicks, n_dofs)), np.empty((n_kicks, n_dofs))
    asked = 0
    for n in range(n_steps):
        if n % segment == 0:
            checkpoints[n // segment, 0] = u
            checkpoints[n // segment, 1] = v
        last_u[:] = u
        last_v[:] = v
        _step(u, v, h, drifts, decay, gain, drive[n], net, dofs, held, turn, force, kept_u, kept_v)
        if n % WATCH_EVERY == 0 or n == n_steps - 1:
            room = smallest_void(kept_u[n_kicks - 1], net)[0]
            if not (room > 0.0 and np.isfinite(v.sum())):
                return n
        while asked < len(interval) and interval[asked] == n:
            w, r = values[asked], rates[asked]
            out_u[asked] = w[0] * last_u + w[1] * u + w[2] * last_v + w[3] * v
            out_v[asked] = r[0] * last_u + r[1] * u + r[2] * last_v + r[3] * v
            asked += 1
    return -1


@compiled
def sweep_back(
    n_steps: int,
    h: float,
    drifts: Floats,
    decay: Floats,
    gain: Floats,
    drive: Floats,
    net: Network,
    dofs: Ints,
    held: Ints,
    segment: int,
    interval: Ints,
    values: Floats,
    rates: Floats,
    checkpoints: Floats,
    bar_out_u: Floats,
    bar_out_v: Floats,
    which: Ints,
    sensitivity: Sensitivity,
    bar_decay: Floats,
    bar_gain: Floats,
    bar_drive: Floats,
) -> None:
    """Reverse sweep of ``run`` from the loss derivatives ``bar_out_u``, ``bar_out_v``.

    Adds to ``sensitivity``, ``bar_decay`` and ``bar_gain`` (as decay and gain) and ``bar_drive``.
    """
    n_kicks, n_dofs = gain.shape
    turn, force = np.empty((n_dofs // 3, 4)), np.empty(n_dofs)
    kept_u = np.empty((segment, n_kicks, n_dofs))
    kept_v = np.empty((segment, n_kicks, n_dofs))
    u, v = np.empty(n_dofs), np.empty(n_dofs)
    bar_u, bar_v = np.zeros(n_dofs), np.zeros(n_dofs)
    left_u, left_v = np.zeros(n_dofs), np.zeros(n_dofs)
    multiplier, product = np.zeros(n_dofs), np.empty(n_dofs)
    asked = len(interval) - 1
    for part in range((n_steps + segment - 1) // segment - 1, -1, -1):
        start = part * segment
        count = min(segment, n_steps - start)
        u[:] = checkpoints[part, 0]
        v[:] = checkpoints[part, 1]
        for n in range(count):
            _step(u, v, h, drifts, decay, gain, drive[start + n], net, dofs, held, turn, force,
                  kept_u[n], kept_v[n])  # fmt: skip
        for n in range(count - 1, -1, -1):
            bar_u += left_u
            bar_v += left_v
            left_u[:] = 0.0
            left_v[:] = 0.0
            while asked >= 0 and interval[asked] == start + n:
                w, r = values[asked], rates[asked]
                one, two = bar_out_u[asked], bar_out_v[asked]
                left_u += w[0] * one + r[0] * two
                bar_u += w[1] * one + r[1] * two
                left_v += w[2] * one + r[2] * two
                bar_v += w[3] * one + r[3] * two
                asked -= 1
            for i in range(len(held)):
                bar_u[held[i]] = 0.0
            for m in range(n_kicks - 1, -1, -1):
                v_after = kept_v[n, m + 1] if m < n_kicks - 1 else v
                for i in range(len(dofs)):
                    d = dofs[i]
                    bar_v[d] += drifts[m + 1] * h * bar_u[d]
                    multiplier[d] = -gain[m, d] * bar_v[d]
                    before = kept_v[n, m, d]
                    bar_decay[m, d] += bar_v[d] * before
                    bar_gain[m, d] -= bar_v[d] * (decay[m, d] * before - v_after[d]) / gain[m, d]
                    bar_v[d] *= decay[m, d]
                hessian_product(kept_u[n, m], net, turn, multiplier, product)
                mixed(kept_u[n, m], net, turn, multiplier, which, sensitivity)
                for i in range(len(dofs)):
                    bar_u[dofs[i]] += product[dofs[i]]
                for i in range(len(held)):
                    bar_drive[start + n, m, i] += product[held[i]]
            for i in range(len(dofs)):
                d = dofs[i]
                bar_v[d] += drifts[0] * h * bar_u[d]
                v[d] = kept_v[n, 0, d]


def highest_frequency(topology: Topology, values: Values, motion: Floats | None = None) -> float:
    """Highest angular eigenfrequency (rad/s) about a state, by Lanczos iteration."""
    network = topology.network(values)
    state = np.zeros(topology.n_dofs) if motion is None else motion
    turn = np.empty((topology.n_units, 4))
    free = topology.free_dofs
    root = np.sqrt(values.mass.ravel()[free])

    def product(x: Floats) -> Floats:
        full, out = np.zeros(topology.n_dofs), np.empty(topology.n_dofs)
        full[free] = np.ravel(x) / root
        hessian_product(state, network, turn, full, out)
        return out[free] / root

    operator = spla.LinearOperator((len(free), len(free)), matvec=product, dtype=float)
    start = np.random.default_rng(0).normal(size=len(free))
    largest = spla.eigsh(operator, k=1, which="LM", v0=start, tol=1e-2, return_eigenvectors=False)
    return float(np.sqrt(abs(largest[0])))


@dataclass(frozen=True)
class Record:
    """What the reverse sweep of one case needs.

    Attributes:
        drive: (n_steps, n_kicks, n_held) prescribed values.
        checkpoints: (n_segments, 2, n_dofs) displacement and velocity.
        touching: ligaments in which contact was computed.
    """

    drive: Floats
    checkpoints: Floats
    touching: Ints

    @property
    def n_steps(self) -> int:
        return len(self.drive)


@dataclass(frozen=True)
class ExplicitSolver:
    """Integrates one case explicitly with equal steps (``dynamics.Solver``).

    A run that leaves the admissible states (a void beyond its barrier, or a blow-up) is repeated
    with half the step, up to MAX_HALVINGS times.

    Attributes:
        topology: the structure.
        duration: s.
        n_steps: number of steps.
        asked: (n_asked,) times of the output, ascending, s.
        threads: cases solved side by side.
        touching: ligaments in which contact is computed, None for all.
        splitting: the method.
    """

    topology: Topology
    duration: float
    n_steps: int
    asked: Floats
    threads: int = 1
    touching: Ints | None = None
    splitting: Splitting = BLANES_MOAN

    def refined(self) -> ExplicitSolver:
        """The same with twice the steps, to estimate the error by."""
        return replace(self, n_steps=2 * self.n_steps)

    def forward(self, values: Values, drive: Drive) -> tuple[Floats, Floats, Record]:
        """See ``dynamics.Solver``."""
        touching = np.arange(len(values.void)) if self.touching is None else self.touching
        for halving in range(MAX_HALVINGS + 1):
            n_steps = self.n_steps * 2**halving
            u, v, record, failed = self._run(values, drive, n_steps, touching)
            if failed < 0:
                held = self.topology.held
                u[:, held] = drive.values(held, self.asked)
                return u, v, record
        raise SimulationError(
            "the explicit run left the admissible states at"
            f" t = {failed * self.duration / n_steps:.6g} s even with {n_steps} steps (a void closed beyond its barrier); try a smaller drive",
            step=failed,
        )

    def _run(
        self, values: Values, drive: Drive, n_steps: int, touching: Ints
    ) -> tuple[Floats, Floats, Record, int]:
        top, h = self.topology, self.duration / n_steps
        n_kicks = len(self.splitting.kicks)
        held_values = np.asarray(drive.values(top.held, self._kick_times(n_steps)))
        held_values = held_values.reshape(n_steps, n_kicks, -1)
        decay, gain = _kicks(values, self.splitting.kicks * h)
        segment = _segment(n_steps)
        checkpoints = np.empty((-(-n_steps // segment), 2, top.n_dofs))
        u, v = (np.zeros((len(self.asked), top.n_dofs)) for _ in range(2))
        failed = run(
            n_steps, h, self.splitting.drifts, decay, gain, held_values,
            top.network(values, touching), top.free_dofs, top.held, segment, *self._outputs(n_steps), checkpoints, u, v,
        )  # fmt: skip
        return u, v, Record(held_values, checkpoints, touching), failed

    def backward(
        self, values: Values, record: Record, bar_u: Floats, bar_v: Floats
    ) -> tuple[Values, Floats, Floats]:
        """See ``dynamics.Solver``."""
        top, h = self.topology, self.duration / record.n_steps
        decay, gain = _kicks(values, self.splitting.kicks * h)
        sensitivity = empty_sensitivity(values)
        bar_decay, bar_gain = np.zeros_like(decay), np.zeros_like(gain)
        bar_drive = np.zeros_like(record.drive)
        sweep_back(
            record.n_steps, h, self.splitting.drifts, decay, gain, record.drive,
            top.network(values, record.touching), top.free_dofs, top.held, _segment(record.n_steps),
            *self._outputs(record.n_steps), record.checkpoints, bar_u, bar_v, top.designed,
            sensitivity, bar_decay, bar_gain, bar_drive,
        )  # fmt: skip
        by_mass, by_damping = _kicks_transposed(
            values, self.splitting.kicks * h, decay, gain, bar_decay, bar_gain
        )
        derivatives = as_parameters(sensitivity, by_mass, by_damping)
        return derivatives, self._kick_times(record.n_steps), bar_drive.reshape(-1, len(top.held))

    def _kick_times(self, n_steps: int) -> Floats:
        """Times (n_steps n_kicks,) at which forces are evaluated."""
        h = self.duration / n_steps
        within = np.cumsum(self.splitting.drifts[:-1])
        return (h * (np.arange(n_steps)[:, None] + within)).ravel()

    def _outputs(self, n_steps: int) -> tuple[Ints, Floats, Floats]:
        times = np.linspace(0, self.duration, n_steps + 1)
        return grid.hermite_stencils(times, self.asked)


def _segment(n_steps: int) -> int:
    """Steps between checkpoints that keep the least in memory."""
    return max(1, int(np.sqrt(n_steps)))


def _kicks(values: Values, lengths: Floats) -> tuple[Floats, Floats]:
    """decay and gain (n_kicks, n_dofs) of kicks of the given lengths (s)."""
    mass, damping = values.mass.ravel(), values.damping.ravel()
    x = lengths[:, None] * damping / mass
    return np.exp(-x), lengths[:, None] / mass * _mean_decay(x)


def _mean_decay(x: Floats) -> Floats:
    """(1 - exp(-x)) / x, finite at zero."""
    safe = np.where(np.abs(x) < 1e-8, 1.0, x)
    return np.where(np.abs(x) < 1e-8, 1 - x / 2, -np.expm1(-safe) / safe)


def _kicks_transposed(
    values: Values,
    lengths: Floats,
    decay: Floats,
    gain: Floats,
    bar_decay: Floats,
    bar_gain: Floats,
) -> tuple[Floats, Floats]:
    """Derivatives by mass and damping (n_dofs,) from those by decay and gain."""
    mass, damping = values.mass.ravel(), values.damping.ravel()
    x = lengths[:, None] * damping / mass
    # gain = length / mass * f(x) with f the mean decay; f'(x) = (decay - f) / x
    f = gain * mass / lengths[:, None]
    slope = np.where(np.abs(x) < 1e-5, -0.5 + x / 3, (decay - f) / np.where(x == 0, 1.0, x))
    bar_x = -decay * bar_decay + lengths[:, None] / mass * slope * bar_gain
    by_mass = -bar_gain * gain / mass - bar_x * x / mass
    return by_mass.sum(axis=0), (bar_x * lengths[:, None] / mass).sum(axis=0)
