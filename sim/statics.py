"""Equilibrium paths of a network by Newton continuation, and their exact adjoint.

The held dofs go through given loads; between two loads the increment adapts itself. A predictor
along the path and every correction stop short of the contact barrier. Corrections descend the
energy: an indefinite tangent is shifted until it is positive definite, so that the path ends in
minima and leaves saddles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

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
    tangent,
)
from sim.model import Topology, Values

KEEP_FROM_BARRIER = 0.9
MAX_CORRECTIONS = 60
MAX_BACKTRACKS = 30
SMALLEST_INCREMENT = 1e-6
ON_THE_WAY = 1e-3
"""Relative residual that suffices between two asked loads."""


@compiled
def _residual(
    motion: Floats, net: Network, turn: Floats, dofs: Ints, held: Ints, scale: Floats, force: Floats
) -> tuple[float, float, float]:
    """Energy, and the largest out-of-balance and reaction force (rotations over ``scale``), N."""
    strain, contact = gradient(motion, net, turn, force)
    residual, reaction = 0.0, 0.0
    for i in range(len(dofs)):
        residual = max(residual, abs(force[dofs[i]]) / scale[dofs[i]])
    for i in range(len(held)):
        reaction = max(reaction, abs(force[held[i]]) / scale[held[i]])
    return strain + contact, residual, reaction


@compiled
def _factorise_shifted(motion: Floats, net: Network, turn: Floats, free: Ints, band: Floats) -> int:
    """Factor of the tangent, shifted if need be; returns the number of shifts tried."""
    shift = 0.0
    for tries in range(40):
        band[:] = 0.0
        tangent(motion, net, turn, free, band)
        if tries > 0:
            if tries == 1:
                for i in range(len(band)):
                    shift = max(shift, abs(band[i, 0]))
                shift *= 1e-5
            else:
                shift *= 4.0
            band[:, 0] += shift
        if factorise(band):
            return tries
    return -1


@compiled
def _correct(
    motion: Floats,
    net: Network,
    turn: Floats,
    free: Ints,
    dofs: Ints,
    held: Ints,
    scale: Floats,
    relative: float,
    absolute: float,
    band: Floats,
    force: Floats,
    step: Floats,
    trial: Floats,
    right: Floats,
    counts: Ints,
) -> bool:
    """Newton descent at fixed held dofs. True once the residual is below its tolerance.

    On success ``band`` holds the factor at the last iterate but one of the path's states unless it
    was needed no more; ``counts`` gathers gradients, factorisations, shifted factorisations.
    """
    energy, residual, reaction = _residual(motion, net, turn, dofs, held, scale, force)
    counts[0] += 1
    for _ in range(MAX_CORRECTIONS):
        if residual <= max(relative * reaction, absolute):
            return True
        shifts = _factorise_shifted(motion, net, turn, free, band)
        counts[1] += 1 + max(shifts, 0)
        counts[2] += shifts != 0
        if shifts < 0:
            return False
        slope = 0.0
        for i in range(len(dofs)):
            right[i] = -force[dofs[i]]
        solve(band, right)
        step[:] = 0.0
        for i in range(len(dofs)):
            step[dofs[i]] = right[i]
            slope += right[i] * force[dofs[i]]
        length = min(1.0, KEEP_FROM_BARRIER * barrier_step(motion, net, step))
        accepted = False
        for _ in range(MAX_BACKTRACKS):
            trial[:] = motion + length * step
            new_energy, new_residual, reaction = _residual(
                trial, net, turn, dofs, held, scale, force
            )
            counts[0] += 1
            descends = new_energy <= energy + 1e-4 * length * slope
            if np.isfinite(new_energy) and (
                descends or (shifts == 0 and new_residual < 0.5 * residual)
            ):
                accepted = True
                break
            length *= 0.5
        if not accepted:
            return False
        motion[:] = trial
        energy, residual = new_energy, new_residual
    return False


@compiled
def follow(
    loads: Floats,
    net: Network,
    free: Ints,
    dofs: Ints,
    held: Ints,
    scale: Floats,
    width: int,
    relative: float,
    absolute: float,
    out: Floats,
    stable: Ints,
    counts: Ints,
) -> tuple[int, float]:
    """Fills ``out`` (n_loads, n_dofs) with the equilibria at ``loads`` (n_loads, n_held).

    ``stable`` (n_loads,) tells whether the tangent there is positive definite. ``counts`` (4,)
    gathers gradients, factorisations, shifted factorisations and increments.

    Returns:
        the number of loads reached, and the fraction of the way to the next.
    """
    n_dofs = len(scale)
    turn, force = np.empty((n_dofs // 3, 4)), np.empty(n_dofs)
    motion, saved, step, trial = (
        np.zeros(n_dofs),
        np.empty(n_dofs),
        np.empty(n_dofs),
        np.empty(n_dofs),
    )
    right, band = np.empty(len(dofs)), np.empty((len(dofs), width + 1))
    increment = 1.0
    # the rest state itself may be out of balance (contact at the start)
    if not _correct(motion, net, turn, free, dofs, held, scale, relative, absolute, band, force, step, trial,
                    right, counts):  # fmt: skip
        return 0, 0.0
    for p in range(len(loads)):
        done = 0.0
        while done < 1.0:
            saved[:] = motion
            counts[3] += 1
            shifts = _factorise_shifted(motion, net, turn, free, band)
            counts[1] += 1 + max(shifts, 0)
            ahead = min(increment, 1.0 - done)
            step[:] = 0.0
            moved = 0.0
            for i in range(len(held)):
                step[held[i]] = (loads[p, i] - motion[held[i]]) * ahead / (1.0 - done)
                moved = max(moved, abs(step[held[i]]))
            if moved > 0.0:
                hessian_product(motion, net, turn, step, force)
                for i in range(len(dofs)):
                    right[i] = -force[dofs[i]]
                solve(band, right)
                for i in range(len(dofs)):
                    step[dofs[i]] = right[i]
            allowed = min(1.0, KEEP_FROM_BARRIER * barrier_step(motion, net, step))
            motion += allowed * step
            reached = done + allowed * ahead
            last = allowed == 1.0 and ahead == 1.0 - done
            if last:
                reached = 1.0
                for i in range(len(held)):
                    motion[held[i]] = loads[p, i]
            before = counts[1]
            converged = shifts >= 0 and _correct(
                motion, net, turn, free, dofs, held, scale, relative if last else ON_THE_WAY, absolute,
                band, force, step, trial, right, counts,
            )  # fmt: skip
            if converged:
                done = reached
                if counts[1] - before <= 5:
                    increment = min(1.0, 2.0 * increment)
            else:
                motion[:] = saved
                increment = 0.25 * allowed * ahead
                if increment < SMALLEST_INCREMENT:
                    out[p] = saved
                    return p, done
        out[p] = motion
        band[:] = 0.0
        tangent(motion, net, turn, free, band)
        counts[1] += 1
        stable[p] = factorise(band)
    return len(loads), 0.0


@compiled
def adjoint(
    states: Floats,
    bar: Floats,
    net: Network,
    free: Ints,
    dofs: Ints,
    held: Ints,
    width: int,
    which: Ints,
    sensitivity: Sensitivity,
    bar_loads: Floats,
) -> int:
    """Adds to the sensitivities of a loss with derivatives ``bar`` by the equilibria ``states``.

    Returns:
        the first load whose tangent is not positive definite, or -1.
    """
    n_dofs = states.shape[1]
    turn, product, weights = np.empty((n_dofs // 3, 4)), np.empty(n_dofs), np.zeros(n_dofs)
    right, band = np.empty(len(dofs)), np.empty((len(dofs), width + 1))
    for p in range(len(states)):
        size = 0.0
        for i in range(len(dofs)):
            right[i] = bar[p, dofs[i]]
            size = max(size, abs(right[i]))
        if size == 0.0:
            continue
        band[:] = 0.0
        tangent(states[p], net, turn, free, band)
        if not factorise(band):
            return p
        solve(band, right)
        for i in range(len(dofs)):
            weights[dofs[i]] = -right[i]
        mixed(states[p], net, turn, weights, which, sensitivity)
        hessian_product(states[p], net, turn, weights, product)
        for i in range(len(held)):
            bar_loads[p, i] += product[held[i]]
    return -1


@dataclass(frozen=True)
class Record:
    """What the reverse sweep of one case needs.

    Attributes:
        states: (n_asked, n_dofs) equilibria.
        stable: (n_asked,) whether each is a minimum of the energy.
        touching: ligaments in which contact was computed.
        counts: (4,) gradients, factorisations, shifted factorisations, increments.
    """

    states: Floats
    stable: Ints
    touching: Ints
    counts: Ints


@dataclass(frozen=True)
class StaticSolver:
    """Finds the equilibria of one case at the asked load parameters (``dynamics.Solver``).

    The load parameter takes the place of time; velocities are zero.

    Attributes:
        topology: the structure.
        asked: (n_asked,) load parameters, in the order in which they are passed.
        relative, absolute: tolerance of the residual, relative to the largest reaction, and its
            floor in N.
        threads: cases solved side by side.
        touching: ligaments in which contact is computed, None for all.
    """

    topology: Topology
    asked: Floats
    relative: float = 1e-10
    absolute: float = 1e-11
    threads: int = 1
    touching: Ints | None = None

    def refined(self) -> StaticSolver:
        """The same to a hundred times tighter a tolerance, to estimate the error by."""
        return replace(self, relative=self.relative / 100)

    def forward(self, values: Values, drive: Drive) -> tuple[Floats, Floats, Record]:
        """See ``dynamics.Solver``."""
        top = self.topology
        touching = np.arange(len(values.void)) if self.touching is None else self.touching
        number, width = top.numbering
        loads = np.asarray(drive.values(top.held, self.asked))
        states = np.zeros((len(loads), top.n_dofs))
        stable, counts = np.zeros(len(loads), dtype=np.int64), np.zeros(4, dtype=np.int64)
        reached, fraction = follow(
            loads, top.network(values, touching), number, top.free_dofs, top.held, top.scale, width,
            self.relative, self.absolute, states, stable, counts,
        )  # fmt: skip
        if reached < len(loads):
            raise SimulationError(
                f"no equilibrium found beyond load {reached} of {len(loads)} (at {fraction:.3g} of the"
                " way to the next): a limit point or jammed contact; try a smaller load or more load steps",
                step=reached,
            )
        return states, np.zeros_like(states), Record(states, stable, touching, counts)

    def backward(
        self, values: Values, record: Record, bar_u: Floats, bar_v: Floats
    ) -> tuple[Values, Floats, Floats]:
        """See ``dynamics.Solver``."""
        top = self.topology
        number, width = top.numbering
        sensitivity = empty_sensitivity(values)
        bar_loads = np.zeros((len(record.states), len(top.held)))
        unstable = adjoint(
            record.states, bar_u, top.network(values, record.touching), number, top.free_dofs,
            top.held, width, top.designed, sensitivity, bar_loads,
        )  # fmt: skip
        if unstable >= 0:
            raise SimulationError(
                f"the equilibrium at load {unstable} is not a minimum of the energy, so it has no"
                " gradient to follow; try another design or more load steps",
                step=unstable,
            )
        zero = np.zeros(top.n_dofs)
        return as_parameters(sensitivity, zero, zero), self.asked, bar_loads
