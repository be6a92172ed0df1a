"""Compiled implicit integration of a network's motion and its exact discrete adjoint.

Equation: M q'' = -dE/dq - C q' on the free dofs, the held ones prescribed. Each implicit stage
solves

    M (u - u* - k v*) / k^2 + C (u - u*) / k + dE/du = 0,   k = gamma h,

for its displacement u by Newton's method; then v = (u - u*) / k and a = (v - v*) / k. The factor is
kept while it contracts. The adjoint refactors at every stage, so that it is the derivative of the
steps taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sim import grid
from sim.arrays import Floats, Ints
from sim.band import factorise, solve
from sim.dynamics import Drive, as_parameters, empty_sensitivity
from sim.errors import SimulationError
from sim.kernels import (
    Network,
    Sensitivity,
    barrier_step,
    compiled,
    gradient,
    hessian_product,
    mixed,
    smallest_void,
    tangent,
)
from sim.model import Topology, Values
from sim.tableau import ESDIRK3, Tableau

MAX_SPLITS = 40
MAX_ITERATIONS = 30
REFACTOR_ABOVE = 0.5
KEEP_FROM_BARRIER = 0.9

CONVERGED, STALLED, INDEFINITE = 0, 1, 2


@compiled
def _fill_tangent(
    motion: Floats,
    net: Network,
    turn: Floats,
    free: Ints,
    dofs: Ints,
    mass: Floats,
    damping: Floats,
    k: float,
    band: Floats,
) -> None:
    """Tangent of a stage: M/k^2 + C/k + K, in band storage."""
    band[:] = 0.0
    tangent(motion, net, turn, free, band)
    for i in range(len(dofs)):
        band[i, 0] += (mass[dofs[i]] / k + damping[dofs[i]]) / k


@compiled
def _solve_stage(
    motion: Floats,
    target: Floats,
    base_u: Floats,
    base_v: Floats,
    k: float,
    tolerance: float,
    net: Network,
    mass: Floats,
    damping: Floats,
    free: Ints,
    dofs: Ints,
    held: Ints,
    scale: Floats,
    band: Floats,
    fresh: bool,
    rate: float,
    turn: Floats,
    force: Floats,
    step: Floats,
    coupling: Floats,
    right: Floats,
    counts: Ints,
) -> tuple[int, bool, float]:
    """Newton iteration of one stage from the guess in ``motion``, whose held dofs go to ``target``.

    Returns the status, whether the factor in ``band`` is usable, and the last contraction rate.
    ``counts`` gathers gradients, factorisations and solves.
    """
    previous = np.inf
    refactored_here = 0
    for iteration in range(MAX_ITERATIONS):
        gradient(motion, net, turn, force)
        counts[0] += 1
        gap = 0.0
        step[:] = 0.0
        for i in range(len(held)):
            step[held[i]] = target[i] - motion[held[i]]
            gap = max(gap, abs(step[held[i]]))
        if not fresh:
            _fill_tangent(motion, net, turn, free, dofs, mass, damping, k, band)
            counts[1] += 1
            refactored_here += 1
            if not factorise(band):
                return INDEFINITE, False, 1.0
            fresh = True
            previous = np.inf
        if gap > 0.0:
            hessian_product(motion, net, turn, step, coupling)
            force += coupling
        for i in range(len(dofs)):
            d = dofs[i]
            velocity = (motion[d] - base_u[d]) / k
            right[i] = -(mass[d] * (velocity - base_v[d]) / k + damping[d] * velocity + force[d])
        solve(band, right)
        counts[2] += 1
        size = 0.0
        for i in range(len(dofs)):
            step[dofs[i]] = right[i]
            size = max(size, abs(right[i]) * scale[dofs[i]])
        allowed = KEEP_FROM_BARRIER * barrier_step(motion, net, step)
        if allowed < 1.0:
            motion += allowed * step
            fresh = False
            previous = np.inf
            continue
        motion += step
        if not size < 1e6:
            return STALLED, False, 1.0
        if previous < np.inf and previous > 0.0:
            rate = size / previous
        if gap == 0.0 or iteration > 0:
            guess = min(rate, 0.9)
            if guess / (1.0 - guess) * size <= tolerance or size <= 1e-13:
                return CONVERGED, fresh and rate < REFACTOR_ABOVE, rate
        if rate > REFACTOR_ABOVE and previous < np.inf:
            if refactored_here > 12:
                return STALLED, False, rate
            fresh = False
        previous = size
    return STALLED, False, rate


@compiled
def march(
    times: Floats,
    drive: Floats,
    initial_u: Floats,
    initial_v: Floats,
    net: Network,
    mass: Floats,
    damping: Floats,
    free: Ints,
    dofs: Ints,
    held: Ints,
    scale: Floats,
    stages: Floats,
    nodes: Floats,
    width: int,
    tolerance: float,
    out_u: Floats,
    out_v: Floats,
    out_a: Floats,
    counts: Ints,
) -> tuple[int, int, int]:
    """Integrates over the fixed grid ``times``.

    Args:
        times: (n_steps + 1,) s.
        drive: (1 + n_steps (n_stages - 1), n_held) prescribed values at the start and every stage.
        initial_u, initial_v: (n_dofs,) state at the start.
        net, mass, damping: the structure, (n_dofs,) each.
        free, dofs, held: numbering, free and held dof ids.
        scale: (n_dofs,) weights that make all dofs lengths.
        stages, nodes: the method's coefficients.
        width: half bandwidth.
        tolerance: of the stage velocity, mm/s.
        out_u, out_v, out_a: (n_steps + 1, n_stages, n_dofs) displacement, velocity and acceleration
            of all stages; row n holds the stages of step n, the last row only the end state in its
            first.
        counts: (3,) gradients, factorisations, solves.

    Returns:
        status, step index reached, dof with the largest residual.
    """
    n_steps, n_stages = len(times) - 1, len(nodes)
    n_dofs = len(mass)
    turn = np.empty((n_dofs // 3, 4))
    force, step, coupling = np.empty(n_dofs), np.empty(n_dofs), np.empty(n_dofs)
    base_u, base_v = np.empty(n_dofs), np.empty(n_dofs)
    motion = np.empty(n_dofs)
    right = np.empty(len(dofs))
    band = np.empty((len(dofs), width + 1))
    fresh, rate, factored_k = False, 0.1, -1.0

    out_u[0, 0] = initial_u
    out_v[0, 0] = initial_v
    out_a[0, 0] = 0.0
    for i in range(len(held)):
        out_u[0, 0, held[i]] = drive[0, i]
    gradient(out_u[0, 0], net, turn, force)
    for i in range(len(dofs)):
        d = dofs[i]
        out_a[0, 0, d] = -(force[d] + damping[d] * out_v[0, 0, d]) / mass[d]

    for n in range(n_steps):
        h = times[n + 1] - times[n]
        for s in range(1, n_stages):
            k = h * stages[s, s]
            if abs(k - factored_k) > 1e-9 * k:
                fresh = False
                factored_k = k
            base_u[:] = out_u[n, 0]
            base_v[:] = out_v[n, 0]
            for j in range(s):
                base_u += h * stages[s, j] * out_v[n, j]
                base_v += h * stages[s, j] * out_a[n, j]
            # guess: the acceleration extrapolated over the stages already known, for all dofs alike
            if s == 1:
                motion[:] = base_u + k * (base_v + k * out_a[n, 0])
            else:
                w = (nodes[s] - nodes[s - 2]) / (nodes[s - 1] - nodes[s - 2])
                motion[:] = base_u + k * (
                    base_v + k * (w * out_a[n, s - 1] + (1.0 - w) * out_a[n, s - 2])
                )
            if smallest_void(motion, net)[0] <= 0.0:
                motion[:] = out_u[n, s - 1]
            target = drive[1 + n * (n_stages - 1) + s - 1]
            status, fresh, rate = _solve_stage(
                motion, target, base_u, base_v, k, tolerance * h, net, mass, damping, free, dofs,
                held, scale, band, fresh, rate, turn, force, step, coupling, right, counts,
            )  # fmt: skip
            if status != CONVERGED:
                worst = 0
                for i in range(len(dofs)):
                    if abs(step[dofs[i]]) * scale[dofs[i]] > abs(step[worst]) * scale[worst]:
                        worst = dofs[i]
                return status, n, worst
            out_u[n, s] = motion
            out_v[n, s] = (motion - base_u) / k
            out_a[n, s] = (out_v[n, s] - base_v) / k
        out_u[n + 1, 0] = out_u[n, n_stages - 1]
        out_v[n + 1, 0] = out_v[n, n_stages - 1]
        out_a[n + 1, 0] = out_a[n, n_stages - 1]
    return CONVERGED, n_steps, 0


@compiled
def adjoint(
    times: Floats,
    stage_u: Floats,
    stage_v: Floats,
    stage_a: Floats,
    bar_u: Floats,
    bar_v: Floats,
    net: Network,
    mass: Floats,
    damping: Floats,
    free: Ints,
    dofs: Ints,
    held: Ints,
    stages: Floats,
    width: int,
    which: Ints,
    sensitivity: Sensitivity,
    bar_mass: Floats,
    bar_damping: Floats,
    bar_drive: Floats,
) -> bool:
    """Reverse sweep of ``march``.

    Args:
        stage_u, stage_v, stage_a: its outputs.
        bar_u, bar_v: (n_steps + 1, n_dofs) loss derivatives by displacement and velocity at the
            grid points.
        which: ligaments whose parameters are differentiated by.
        sensitivity: ``kernels.Sensitivity``, added to.
        bar_mass, bar_damping: (n_dofs,), added to.
        bar_drive: shaped as the drive, added to.

    Returns:
        False if a stage's tangent is not positive definite.
    """
    n_steps, n_stages = len(times) - 1, stages.shape[0]
    n_dofs = len(mass)
    turn = np.empty((n_dofs // 3, 4))
    product, weights = np.empty(n_dofs), np.zeros(n_dofs)
    u, v, a = (
        np.zeros((n_stages, n_dofs)),
        np.zeros((n_stages, n_dofs)),
        np.zeros((n_stages, n_dofs)),
    )
    next_a = np.zeros(n_dofs)
    next_u, next_v = bar_u[n_steps].copy(), bar_v[n_steps].copy()
    right = np.empty(len(dofs))
    band = np.empty((len(dofs), width + 1))
    for n in range(n_steps - 1, -1, -1):
        h = times[n + 1] - times[n]
        u[:] = 0.0
        v[:] = 0.0
        a[:] = 0.0
        u[n_stages - 1] = next_u
        v[n_stages - 1] = next_v
        a[n_stages - 1] = next_a
        next_u[:] = bar_u[n]
        next_v[:] = bar_v[n]
        next_a[:] = 0.0
        for s in range(n_stages - 1, 0, -1):
            k = h * stages[s, s]
            motion = stage_u[n, s]
            for i in range(len(dofs)):
                d = dofs[i]
                right[i] = u[s, d] + (v[s, d] + a[s, d] / k) / k
            _fill_tangent(motion, net, turn, free, dofs, mass, damping, k, band)
            if not factorise(band):
                return False
            solve(band, right)
            for i in range(len(dofs)):
                weights[dofs[i]] = -right[i]
            mixed(motion, net, turn, weights, which, sensitivity)
            hessian_product(motion, net, turn, weights, product)
            for i in range(len(held)):
                bar_drive[1 + n * (n_stages - 1) + s - 1, i] += product[held[i]]
            for i in range(len(dofs)):
                d = dofs[i]
                bar_mass[d] -= right[i] * stage_a[n, s, d]
                bar_damping[d] -= right[i] * stage_v[n, s, d]
                base_v = mass[d] / k * right[i] - a[s, d] / k
                base_u = (mass[d] / k + damping[d]) / k * right[i] - (v[s, d] + a[s, d] / k) / k
                next_u[d] += base_u
                next_v[d] += base_v
                v[0, d] += h * stages[s, 0] * base_u
                a[0, d] += h * stages[s, 0] * base_v
                for j in range(1, s):
                    v[j, d] += h * stages[s, j] * base_u
                    a[j, d] += h * stages[s, j] * base_v
        next_v += v[0]
        next_a += a[0]
    for i in range(len(dofs)):
        d = dofs[i]
        right[i] = next_a[d] / mass[d]
        weights[d] = -right[i]
        bar_mass[d] -= right[i] * stage_a[0, 0, d]
        bar_damping[d] -= right[i] * stage_v[0, 0, d]
    mixed(stage_u[0, 0], net, turn, weights, which, sensitivity)
    hessian_product(stage_u[0, 0], net, turn, weights, product)
    for i in range(len(held)):
        bar_drive[0, i] += product[held[i]]
    return True


@dataclass(frozen=True)
class Record:
    """What the reverse sweep of one case needs.

    Attributes:
        times: (n_steps + 1,) the grid used, with any step that had to be split.
        u, v, a: (n_steps + 1, n_stages, n_dofs) stage values.
        touching: ligaments in which contact was computed.
        counts: (3,) gradients, factorisations, solves.
    """

    times: Floats
    u: Floats
    v: Floats
    a: Floats
    touching: Ints
    counts: Ints


@dataclass(frozen=True)
class ImplicitSolver:
    """Integrates one case with an L-stable implicit method on a frozen grid (``dynamics.Solver``).

    A step that fails is cut in two, for this solve alone, until it passes.

    Attributes:
        topology: the structure.
        times: (n_steps + 1,) grid, s.
        asked: (n_asked,) times of the output, s.
        tolerance: of the stage velocities, mm/s.
        threads: cases solved side by side.
        turn_allowance: contact is skipped in ligaments whose units can turn by this much against
            each other before it acts, rad. If one comes that far after all, the case is solved
            again with all.
        tableau: the method.
    """

    topology: Topology
    times: Floats
    asked: Floats
    tolerance: float = 1e-4
    threads: int = 1
    turn_allowance: float = np.inf
    tableau: Tableau = ESDIRK3

    def refined(self) -> ImplicitSolver:
        """The same with every step cut in two, to estimate the error by."""
        return replace(self, times=grid.halved(self.times))

    def touching(self, values: Values) -> Ints:
        """Ligaments in which contact is computed."""
        return np.flatnonzero(values.void.min(axis=1) < self.topology.cutoff + self.turn_allowance)

    def forward(self, values: Values, drive: Drive) -> tuple[Floats, Floats, Record]:
        """See ``dynamics.Solver``."""
        touching = self.touching(values)
        record = self._march(values, drive, touching)
        if self._untouched_voids_close(values, record):
            record = self._march(values, drive, np.arange(len(values.void)))
        value, slope = grid.hermite_matrices(record.times, self.asked)
        states = np.concatenate([record.u[:, 0], record.v[:, 0]])
        displacement, velocity = value @ states, slope @ states
        held = self.topology.held
        displacement[:, held] = drive.values(held, self.asked)
        return displacement, velocity, record

    def _untouched_voids_close(self, values: Values, record: Record) -> bool:
        """Whether a void whose contact was skipped came to the cutoff in any stage."""
        stages = record.u[:-1].reshape(-1, self.topology.n_units, 3)
        closest = self.topology.smallest_void_angles(values.void, stages).min(axis=0)
        closest[record.touching] = np.inf
        return bool(closest.min() < self.topology.cutoff)

    def _march(self, values: Values, drive: Drive, touching: Ints) -> Record:
        top = self.topology
        network = top.network(values, touching)
        number, width = top.numbering
        n_stages = len(self.tableau.nodes)
        times = self.times
        counts = np.zeros(3, dtype=np.int64)
        for _ in range(MAX_SPLITS):
            u, v, a = (np.empty((len(times), n_stages, top.n_dofs)) for _ in range(3))
            held_values = drive.values(top.held, grid.stage_times(times, self.tableau.nodes))
            status, step, worst = march(
                times, np.asarray(held_values), np.zeros(top.n_dofs), np.zeros(top.n_dofs), network,
                values.mass.ravel(), values.damping.ravel(), number, top.free_dofs, top.held,
                top.scale, self.tableau.stages, self.tableau.nodes, width, self.tolerance, u, v, a, counts,
            )  # fmt: skip
            if status == CONVERGED:
                return Record(times, u, v, a, touching, counts)
            times = grid.split_step(times, step)
        raise SimulationError(
            f"the step at t = {times[step]:.6g} s failed after {MAX_SPLITS} cuts, worst at unit"
            f" {worst // 3} (the tangent is indefinite or a contact jams); try a smaller drive or"
            " accuracy: tight",
            step=step,
            unit=worst // 3,
        )

    def backward(
        self, values: Values, record: Record, bar_u: Floats, bar_v: Floats
    ) -> tuple[Values, Floats, Floats]:
        """See ``dynamics.Solver``."""
        top = self.topology
        number, width = top.numbering
        value, slope = grid.hermite_matrices(record.times, self.asked)
        bar_states = value.T @ bar_u + slope.T @ bar_v
        stage_times = grid.stage_times(record.times, self.tableau.nodes)
        sensitivity = empty_sensitivity(values)
        bar_mass, bar_damping = np.zeros(top.n_dofs), np.zeros(top.n_dofs)
        bar_drive = np.zeros((len(stage_times), len(top.held)))
        positive = adjoint(
            record.times, record.u, record.v, record.a,
            bar_states[: len(record.times)],
 bar_states[len(record.times) :], top.network(values, record.touching), values.mass.ravel(),
            values.damping.ravel(), number, top.free_dofs, top.held, self.tableau.stages, width,
            top.designed, sensitivity, bar_mass, bar_damping, bar_drive,
        )  # fmt: skip
        if not positive:
            raise SimulationError(
                "a stage's tangent is indefinite in the adjoint; try shorter steps"
            )
        gradient_ = as_parameters(sensitivity, bar_mass, bar_damping)
        return gradient_, stage_times, bar_drive
