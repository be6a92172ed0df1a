"""Integrates one case explicitly behind the common interface of the solvers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sim.collision import raise_new_pairs
from sim.core import Floats, Ints, SimulationError
from sim.energy import System, Topology, as_values, empty_bars, observe, system_of, workspace
from sim.solvers import PrescribedMotion, check_masses, check_start
from sim.structure import ConcreteParameters, VoidAngleContact
from sim.time_integration import time_grid
from sim.time_integration.coefficients import BLANES_MOAN, Splitting
from sim.time_integration.contact_substeps import Substeps
from sim.time_integration.symplectic import Outputs, Steps, run, sweep_back
from sim.vibration import highest_frequency

MAX_REFINEMENTS = 4
LIMIT_MARGIN = 0.95
BARRIER_STEP = 0.1
"""Finer steps at a barrier, in shares of the stability limit."""
STEP_RATIO = 1.25
MOST_MEMORY = 2 << 30
"""Bytes that the drive's values at all kicks may take: some hundred million kicks of a unit."""
FREQUENCY_GROWTH = 1.5
"""Highest eigenfrequency in motion over that at rest, as expected before the first run."""
NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class ExplicitRecord:
    """Holds what the reverse sweep of one case needs."""

    steps: Steps  # as taken
    checkpoints: Floats  # (n_segments, 2, n_dofs) displacement and velocity
    topology: Topology  # as solved, with room for all units that met


@dataclass(frozen=True)
class ExplicitSolver:
    """Integrates one case explicitly with equal steps (``Solver``).

    The step is cut to one that is likely to be stable for the structure, judged at rest, and after
    a run to one that is in the state that stores the most energy; and halved as long as the run
    leaves the admissible states (a blow-up, units that overlap), MAX_REFINEMENTS runs in all.
    Contact on void angles asks for no shorter step: the voids' barriers have finer ones of their
    own.
    """

    topology: Topology  # the structure
    duration: float  # s
    n_steps: int  # number of steps to take if that is stable
    output_times: Floats  # (n_times,) times of the output, ascending, s
    threads: int = 1  # see ``Solver``; it factorises nothing
    splitting: Splitting = BLANES_MOAN  # the method

    def refined(self, record: ExplicitRecord) -> ExplicitSolver:
        """See ``Solver``."""
        return replace(self, n_steps=2 * record.steps.n_steps)

    def coupling(self, pairs: Ints) -> ExplicitSolver:
        """See ``Solver``."""
        return replace(self, topology=self.topology.coupling(pairs))

    def forward(
        self, values: ConcreteParameters, drive: PrescribedMotion
    ) -> tuple[Floats, Floats, ExplicitRecord]:
        """See ``Solver``."""
        top = self.topology
        time_grid.check_output_times(self.output_times, self.duration)
        system = system_of(top, values, NONE)
        check_masses(values)
        check_start(top, values, system.contacts, drive.start(top, 0.0))
        stable = self._steps_for(FREQUENCY_GROWTH * highest_frequency(top, values, touching=NONE))
        for _ in range(MAX_REFINEMENTS):
            steps = self._steps(system, drive, stable)
            checkpoints = np.empty((-(-steps.n_steps // steps.segment), 2, top.n_dofs))
            u, v = (np.zeros((len(self.output_times), top.n_dofs)) for _ in range(2))
            outputs = self._outputs(steps.n_steps)
            failed = run(
                steps,
                outputs,
                system,
                workspace(system),
                self._contact_ligaments,
                checkpoints,
                u,
                v,
            )
            raise_new_pairs(system.contacts)
            needed = 2 * stable if failed >= 0 else self._steps_in_motion(values, u, stable)
            if needed <= stable:
                return u, v, ExplicitRecord(steps, checkpoints, top)
            stable = needed
        raise _failure(failed, steps.n_steps, stable)

    def adjoint_memory(self) -> int:
        """Counts the bytes that checkpoints and one segment's states take."""
        n_dofs, segment = self.topology.n_dofs, _segment(self.n_steps)
        n_kicks, n_ligaments = len(self.splitting.kicks), len(self.topology.ligament_units)
        n_states = 2 * -(-self.n_steps // segment) + segment * (3 * n_kicks + 2)
        kinematics = segment * n_kicks * (4 * n_dofs // 3 + n_ligaments)
        return np.dtype(float).itemsize * (n_dofs * n_states + kinematics)

    def _steps_for(self, frequency: float) -> int:
        """Counts the steps that are stable at an angular eigenfrequency (rad/s), on a ladder.

        Rungs keep the grid from following every change of a design: the loss would jump.
        """
        limit = LIMIT_MARGIN * self.splitting.stability
        needed = self.duration * frequency / limit
        rung = np.ceil(np.log(max(needed / self.n_steps, 1.0)) / np.log(STEP_RATIO))
        return int(np.ceil(self.n_steps * STEP_RATIO**rung))

    def _steps_in_motion(self, values: ConcreteParameters, states: Floats, taken: int) -> int:
        """Counts the steps that are stable in the one of the states whose energy is greatest.

        They are twice those `taken` if units overlap in a state, which may lie between two steps.
        """
        seen = observe(
            self.topology,
            values,
            states[:, : 3 * self.topology.n_units].reshape(len(states), -1, 3),
        )
        energy = seen.strain_energy + seen.contact_energy
        if not np.isfinite(energy).all():
            return 2 * taken
        fullest = states[energy.argmax()]
        return self._steps_for(highest_frequency(self.topology, values, fullest, NONE))

    @property
    def _contact_ligaments(self) -> Ints:
        """Ligaments whose voids may come to contact."""
        by_angle = isinstance(self.topology.contact, VoidAngleContact)
        return np.arange(len(self.topology.ligament_units)) if by_angle else NONE

    def backward(
        self, values: ConcreteParameters, record: ExplicitRecord, bar_u: Floats, bar_v: Floats
    ) -> tuple[ConcreteParameters, Floats, Floats]:
        """See ``Solver``."""
        top, steps = record.topology, record.steps
        system = system_of(top, values, NONE)
        bars = empty_bars(system, steps.drive.shape)
        bar_decay, bar_gain = np.zeros_like(steps.decay), np.zeros_like(steps.gain)
        outputs = self._outputs(steps.n_steps)
        sweep_back(
            steps, outputs, system, workspace(system), self._contact_ligaments, record.checkpoints,
            bar_u, bar_v, top.designed, bars, bar_decay, bar_gain,
        )  # fmt: skip
        raise_new_pairs(system.contacts)
        lengths = self.splitting.kicks * steps.h
        by_mass, by_damping = _kicks_transposed(system, lengths, steps, bar_decay, bar_gain)
        bars.mass[:] += by_mass
        bars.damping[:] = by_damping
        by_drive = bars.drive.reshape(-1, len(top.held))
        return as_values(bars, top.n_units), self._kick_times(steps.n_steps), by_drive

    def _steps(self, system: System, drive: PrescribedMotion, n_steps: int) -> Steps:
        h, n_kicks = self.duration / n_steps, len(self.splitting.kicks)
        needed = np.dtype(float).itemsize * n_steps * n_kicks * len(self.topology.held)
        if needed > MOST_MEMORY:
            raise SimulationError(
                f"the explicit run needs {n_steps} steps of {h:.3g} s to be stable, and"
                f" {needed / 1e9:.3g} GB for its drive alone; try softer ligaments, heavier units,"
                " a shorter time or integrator: implicit"
            )
        held = drive.values(self.topology.held, self._kick_times(n_steps))
        return Steps(
            n_steps,
            h,
            Substeps(
                self.splitting.drifts, self.splitting.kicks, BARRIER_STEP * self.splitting.stability
            ),
            *_kicks(system, self.splitting.kicks * h),
            held.reshape(n_steps, n_kicks, -1),
            _segment(n_steps),
        )

    def _kick_times(self, n_steps: int) -> Floats:
        """Times (n_steps n_kicks,) at which forces are evaluated."""
        h = self.duration / n_steps
        fractions = np.cumsum(self.splitting.drifts[:-1])
        return np.asarray((h * (np.arange(n_steps)[:, None] + fractions)).ravel())

    def _outputs(self, n_steps: int) -> Outputs:
        times = np.linspace(0, self.duration, n_steps + 1)
        return Outputs(*time_grid.hermite_stencils(times, self.output_times))


def _failure(failed: int, n_steps: int, needed: int) -> SimulationError:
    """Explains the end of the last run: a step `failed` of its `n_steps`, or none (-1)."""
    remedy = "try a smaller drive or a larger smallest edge"
    if failed < 0:
        return SimulationError(
            f"the explicit run comes to states that need {needed} steps to be stable, after"
            f" {MAX_REFINEMENTS} tries, the last with {n_steps}; {remedy}"
        )
    return SimulationError(
        f"the explicit run is unstable or leaves the admissible states (step {failed}) even"
        f" with {n_steps} steps; {remedy}",
        step=failed,
    )


def _segment(n_steps: int) -> int:
    """Steps between checkpoints: as many checkpoints as there are steps between two of them."""
    return max(1, int(np.sqrt(n_steps)))


def _kicks(system: System, lengths: Floats) -> tuple[Floats, Floats]:
    """Computes decay and gain (n_kicks, n_dofs) of kicks of the given lengths (s)."""
    mass, damping = system.mass, system.damping
    x = lengths[:, None] * damping / mass
    return np.exp(-x), lengths[:, None] / mass * _mean_decay(x)


def _mean_decay(x: Floats) -> Floats:
    """Computes (1 - exp(-x)) / x, finite at zero."""
    safe = np.where(np.abs(x) < 1e-8, 1.0, x)
    return np.where(np.abs(x) < 1e-8, 1 - x / 2, -np.expm1(-safe) / safe)


def _kicks_transposed(
    system: System, lengths: Floats, steps: Steps, bar_decay: Floats, bar_gain: Floats
) -> tuple[Floats, Floats]:
    """Pulls derivatives by decay and gain back to those by mass and damping (n_dofs,)."""
    mass, damping = system.mass, system.damping
    x = lengths[:, None] * damping / mass
    # gain = length / mass * f(x) with f the mean decay; f'(x) = (decay - f) / x
    f = steps.gain * mass / lengths[:, None]
    small = np.abs(x) < 1e-5
    slope = np.where(small, -0.5 + x / 3, (steps.decay - f) / np.where(small, 1.0, x))
    bar_x = -steps.decay * bar_decay + lengths[:, None] / mass * slope * bar_gain
    by_mass = -bar_gain * steps.gain / mass - bar_x * x / mass
    return by_mass.sum(axis=0), (bar_x * lengths[:, None] / mass).sum(axis=0)
