"""Integrates one case implicitly behind the common interface of the solvers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sim.collision import raise_new_pairs
from sim.core import Floats, Ints, SimulationError
from sim.energy import Topology, as_values, empty_bars, system_of, workspace
from sim.solvers import PrescribedMotion, check_masses, check_start, inadmissible
from sim.structure import ConcreteParameters, VoidAngleContact
from sim.time_integration import time_grid
from sim.time_integration.coefficients import ESDIRK3, Tableau
from sim.time_integration.esdirk import march
from sim.time_integration.esdirk_adjoint import adjoint
from sim.time_integration.esdirk_stage import CONVERGED

MAX_SPLITS = 100
PATIENCE = 20
"""Cuts of single steps, after which all steps to come are cut in two: the grid is too coarse."""


@dataclass(frozen=True)
class ImplicitRecord:
    """Holds what the reverse sweep of one case needs."""

    times: Floats  # (n_steps + 1,) the grid used, with any step that had to be split
    # u, v, a: (n_steps + 1, n_stages, n_dofs) stage values
    u: Floats
    v: Floats
    a: Floats
    touching: Ints  # ligaments in which contact was computed
    counts: Ints  # (3,) gradients, factorisations, solves
    topology: Topology  # as solved, with room for all units that met


@dataclass(frozen=True)
class ImplicitSolver:
    """Integrates one case with an L-stable implicit method on a frozen grid (``Solver``).

    A step that fails is cut in two, for this solve alone, until it passes, and now and then all
    steps after it; so is one within which the output, interpolated, has units in one another.
    """

    topology: Topology  # the structure
    times: Floats  # (n_steps + 1,) grid, s
    output_times: Floats  # (n_times,) times of the output, s
    tolerance: float = 1e-4  # of the stage velocities, mm/s
    threads: int = 1  # see ``Solver``
    # contact is skipped in ligaments whose units can turn by this much against each other before it
    # acts, rad. If one comes that far after all, the case is solved again with all.
    turn_allowance: float = np.inf
    tableau: Tableau = ESDIRK3  # the method

    def refined(self, record: ImplicitRecord) -> ImplicitSolver:
        """See ``Solver``."""
        return replace(self, times=time_grid.halved(record.times))

    def touching(self, values: ConcreteParameters) -> Ints:
        """Finds the ligaments in which contact is computed."""
        law = self.topology.contact
        if not isinstance(law, VoidAngleContact):
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(values.void.min(axis=1) < law.cutoff_angle + self.turn_allowance)

    def coupling(self, pairs: Ints) -> ImplicitSolver:
        """See ``Solver``."""
        return replace(self, topology=self.topology.coupling(pairs))

    def forward(
        self, values: ConcreteParameters, drive: PrescribedMotion
    ) -> tuple[Floats, Floats, ImplicitRecord]:
        """See ``Solver``."""
        time_grid.check_output_times(self.output_times, float(self.times[-1]))
        record = self._march(values, drive, self.touching(values), self.times)
        if self._skipped_contact_closes(values, record):
            record = self._march(values, drive, np.arange(len(values.void)), self.times)
        for _ in range(MAX_SPLITS):
            value, slope = time_grid.hermite_matrices(record.times, self.output_times)
            states = np.concatenate([record.u[:, 0], record.v[:, 0]])
            u, v = value @ states, slope @ states
            u[:, self.topology.held] = drive.values(self.topology.held, self.output_times)
            beyond = self.output_times[inadmissible(record.topology, values, u)]
            if len(beyond) == 0:
                return u, v, record
            times = time_grid.split_steps(record.times, time_grid.steps_of(record.times, beyond))
            record = self._march(values, drive, record.touching, times)
        raise SimulationError(
            f"at t = {beyond[0]:.6g} s units pass through each other between two steps; try"
            " more output times, a smaller drive or accuracy: tight"
        )

    def _skipped_contact_closes(self, values: ConcreteParameters, record: ImplicitRecord) -> bool:
        """Tests if a void whose contact was skipped came to the cutoff in any stage."""
        law = self.topology.contact
        if not isinstance(law, VoidAngleContact):
            return False
        n_units = self.topology.n_units
        stages = record.u[:-1, :, : 3 * n_units].reshape(-1, n_units, 3)
        closest = self.topology.closest_void_angles(values.void, stages)
        closest[record.touching] = np.inf
        return bool(closest.min() < law.cutoff_angle)

    def _march(
        self, values: ConcreteParameters, drive: PrescribedMotion, touching: Ints, times: Floats
    ) -> ImplicitRecord:
        top, tableau = self.topology, self.tableau
        system = system_of(top, values, touching)
        check_masses(values)
        check_start(top, values, system.contacts, drive.start(top, float(times[0])))
        counts, step = np.zeros(3, dtype=np.int64), 0
        shape = (len(times), len(tableau.nodes), top.n_dofs)
        u, v, a = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        for attempt in range(1, MAX_SPLITS + 1):
            held = drive.values(top.held, time_grid.stage_times(times, tableau.nodes))
            status, step, worst = march(
                times, step, held, system, workspace(system, self.threads), tableau.stages,
                tableau.nodes, self.tolerance, u, v, a, counts,
            )  # fmt: skip
            raise_new_pairs(system.contacts)
            if status == CONVERGED:
                return ImplicitRecord(times, u, v, a, touching, counts, top)
            last = len(times) - 1 if attempt % PATIENCE == 0 else step + 1
            times = time_grid.split_steps(times, np.arange(step, last))
            u, v, a = (_extended(stages, step, len(times)) for stages in (u, v, a))
        raise SimulationError(
            f"the step at t = {times[step]:.6g} s failed after {MAX_SPLITS} cuts, worst at unit"
            f" {worst // 3} (the tangent is indefinite or a contact jams); try a smaller drive or"
            " accuracy: tight",
            step=step,
            unit=worst // 3,
        )

    def backward(
        self, values: ConcreteParameters, record: ImplicitRecord, bar_u: Floats, bar_v: Floats
    ) -> tuple[ConcreteParameters, Floats, Floats]:
        """See ``Solver``."""
        top, n_times = record.topology, len(record.times)
        system = system_of(top, values, record.touching)
        value, slope = time_grid.hermite_matrices(record.times, self.output_times)
        bar_states = value.T @ bar_u + slope.T @ bar_v
        stage_times = time_grid.stage_times(record.times, self.tableau.nodes)
        bars = empty_bars(system, (len(stage_times), len(top.held)))
        positive = adjoint(
            record.times,
            record.u,
            record.v,
            record.a,
            bar_states[:n_times],
            bar_states[n_times:],
            system,
            workspace(system, self.threads),
            self.tableau.stages,
            top.designed,
            bars,
        )
        raise_new_pairs(system.contacts)
        if not positive:
            raise SimulationError(
                "a stage's tangent is indefinite in the adjoint; try shorter steps"
            )
        return as_values(bars, top.n_units), stage_times, bars.drive


def _extended(stages: Floats, step: int, n_times: int) -> Floats:
    """Makes room for more times, with the values of the steps before ``step`` and at its start."""
    kept = np.zeros((n_times, *stages.shape[1:]))
    kept[: step + 1] = stages[: step + 1]
    return kept
