"""Equilibria of one case behind the common interface of the solvers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sim.arrays import Floats, Ints
from sim.dynamics import Drive
from sim.equilibrium import adjoint, follow
from sim.errors import SimulationError
from sim.model import Topology, Values
from sim.system import as_values, empty_bars, system_of


@dataclass(frozen=True)
class Record:
    """What the reverse sweep of one case needs.

    Attributes:
        states: (n_asked, n_dofs) equilibria.
        stable: (n_asked,) whether each is a minimum of the energy.
        jumped: (n_asked,) whether the structure jumped on the way there: its path ended in a limit
            point or branched.
        counts: (4,) gradients, factorisations, shifted factorisations, increments.
    """

    states: Floats
    stable: Ints
    jumped: Ints
    counts: Ints


@dataclass(frozen=True)
class StaticSolver:
    """Finds the equilibria of one case at the asked load parameters (``dynamics.Solver``).

    The load parameter takes the place of time; the velocities of free dofs are zero.

    Attributes:
        topology: the structure.
        asked: (n_asked,) load parameters, in the order in which they are passed.
        relative: tolerance of the residual, relative to the largest reaction.
        absolute: its floor, N.
        threads: cases solved side by side.
        start: of a similar structure under the same drive, whose steps between the asked loads are
            tried before the path is followed step by step; of the result they change no more than
            the tolerance allows. Where that structure jumped its step is not tried.
    """

    topology: Topology
    asked: Floats
    relative: float = 1e-10
    absolute: float = 1e-11
    threads: int = 1
    start: Record | None = None

    def refined(self, record: Record) -> StaticSolver:
        """The same to a hundred times tighter a tolerance: equilibria have no steps to halve."""
        del record
        return replace(self, relative=self.relative / 100)

    def forward(self, values: Values, drive: Drive) -> tuple[Floats, Floats, Record]:
        """See ``dynamics.Solver``."""
        top = self.topology
        loads = drive.values(top.held, self.asked)
        states = np.zeros((len(loads), top.n_dofs))
        stable, jumped = (np.zeros(len(loads), dtype=np.int64) for _ in range(2))
        counts = np.zeros(4, dtype=np.int64)
        known, trusted = self._known(states)
        system = system_of(top, values)
        reached, fraction = follow(
            loads, known, trusted, system, self.relative, self.absolute, states, stable, jumped,
            counts,
        )  # fmt: skip
        if reached < len(loads):
            where = top.smallest_void_angles(values.void, states[reached].reshape(-1, 3)).argmin()
            unit = int(top.ligament_units[where, 0])
            raise SimulationError(
                f"no equilibrium found beyond load {reached} of {len(loads)} (at {fraction:.3g} of"
                f" the way to the next; the narrowest void is at unit {unit}): jammed contact or no"
                " stable state; try a smaller load or more load steps",
                step=reached,
                unit=unit,
                states=states[:reached],
            )
        record = Record(states, stable, jumped, counts)
        return states.copy(), np.zeros_like(states), record

    def _known(self, states: Floats) -> tuple[Floats, Ints]:
        """States of the start, and whether to try the step to each."""
        if self.start is None or self.start.states.shape != states.shape:
            return states, np.zeros(len(states), dtype=np.int64)
        return self.start.states, 1 - self.start.jumped

    def backward(
        self, values: Values, record: Record, bar_u: Floats, bar_v: Floats
    ) -> tuple[Values, Floats, Floats]:
        """See ``dynamics.Solver``."""
        del bar_v
        top = self.topology
        system = system_of(top, values)
        bars = empty_bars(system, (len(record.states), len(top.held)))
        unstable = adjoint(record.states, bar_u, system, top.designed, bars)
        if unstable >= 0:
            raise SimulationError(
                f"the equilibrium at load {unstable} is not a minimum of the energy, so it has no"
                " gradient to follow; try another design or more load steps",
                step=unstable,
            )
        return as_values(bars), self.asked, bars.drive
