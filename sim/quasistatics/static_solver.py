"""Finds equilibria of one case behind the common interface of the solvers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from sim.collision import new_pairs, raise_new_pairs
from sim.core import Floats, Ints, SimulationError
from sim.energy import System, Topology, as_values, empty_bars, system_of, workspace
from sim.quasistatics.equilibrium_path import MOST_SNAPS, Branch, adjoint, follow
from sim.solvers import (
    PrescribedMotion,
    check_connected,
    check_ligaments,
    check_start,
)
from sim.structure import ConcreteParameters

ROUNDING, ROUNDING_OF_MOTION = 4e-14, 1e-15
"""Of the end of a ligament at rest, mm, and per mm that the drive moves it by: what its axial
stiffness makes of these is no force to balance."""


@dataclass(frozen=True)
class StaticRecord:
    """Holds what the reverse sweep of one case needs."""

    states: Floats  # (n_times, n_dofs) equilibria
    tangents: Floats  # (n_times, n_dofs) step to each along the path's tangent at the one before
    stable: Ints  # (n_times,) whether each is a minimum of the energy
    # (n_times,) whether the structure jumped on the way there: 1 from a limit point, 2 from a
    # branching, else 0
    jumped: Ints
    snapped: Floats  # (n_times,) load parameter at which it last did, NaN if it did not
    # (n_times,) smallest one of the tangent at fixed held dofs, with rotations times the topology's
    # scale, N/mm
    eigenvalue: Floats
    counts: Ints  # (4,) gradients, factorisations, shifted factorisations, increments
    topology: Topology | None = None  # with room for all units that met; None: the solver's
    snaps: Floats = field(default_factory=lambda: np.zeros(0))  # (n_snaps,) load parameters


@dataclass(frozen=True)
class StaticSolver:
    """Finds the equilibria of one case at the given load parameters (``Solver``).

    The load parameter takes the place of time; the velocities of free dofs are zero.
    """

    topology: Topology  # the structure
    output_times: Floats  # (n_times,) load parameters, in the order in which they are passed
    relative: float = 1e-10  # tolerance of the residual, relative to the largest reaction
    absolute: float = 1e-11 / 120.0  # its floor by the greatest axial stiffness, mm
    threads: int = 1  # see ``Solver``
    # of a similar structure under the same drive, whose steps between the output loads are tried
    # before the path is followed step by step; of the result they change no more than the tolerance
    # allows. Where that structure jumped its step is not tried. A step is the tangent's, bent as it
    # was there.
    start: StaticRecord | None = None
    substeps: int = 1  # loads to pass on the way to each output load, that one included
    sense: float = 1.0  # in which the critical mode of a branching is followed: 1 or -1
    leaves: bool = True  # a path that ends, by a snap; else states from there on are not a number
    # from the load before, where units meet for which the tangent has no room; else from rest: by
    # other last bits an optimisation goes another way
    continues: bool = False

    def refined(self, record: StaticRecord) -> StaticSolver:
        """Passes twice the loads, each to a hundred times tighter a tolerance."""
        del record
        return replace(self, relative=self.relative / 100, start=None, substeps=2 * self.substeps)

    def coupling(self, pairs: Ints) -> StaticSolver:
        """See ``Solver``."""
        return replace(self, topology=self.topology.coupling(pairs))

    def forward(
        self, values: ConcreteParameters, drive: PrescribedMotion
    ) -> tuple[Floats, Floats, StaticRecord]:
        """See ``Solver``."""
        check_connected(self.topology)
        loads = self._loads(drive)
        branch = _empty_branch(len(loads.values), self.topology.n_dofs)
        counts, progress = np.zeros(4, dtype=np.int64), np.zeros(4)
        top = self.topology
        system = system_of(top, values)
        check_start(top, values, system.contacts, np.zeros(top.n_dofs))
        reached, fraction = self._follow_path(
            values, loads, 0, progress, top, system, branch, counts
        )
        while self.continues and len(met := new_pairs(system.contacts)) > 0:
            top = top.coupling(met)
            system = system_of(top, values)
            _clear(branch, reached)
            reached, fraction = self._follow_path(
                values, loads, reached, progress, top, system, branch, counts
            )
        raise_new_pairs(system.contacts)
        if reached < len(loads.values):
            if self.leaves or not branch.jumped[reached]:
                raise self._no_equilibrium(values, branch.states[: reached + 1], fraction, loads)
            branch.states[reached:] = np.nan
        check_ligaments(top, values, branch.states[:reached])
        record = _record(branch, counts, top, loads)
        return record.states.copy(), np.zeros_like(record.states), record

    def _follow_path(
        self, values: ConcreteParameters, loads: _Loads, known: int, progress: Floats,
        top: Topology, system: System, branch: Branch, counts: Ints,
    ) -> tuple[int, float]:  # fmt: skip
        """Follows the path on from its first `known` loads; see ``follow``."""
        bends, trusted = self._path_curvature(branch.states, loads.output)
        rounding = ROUNDING + ROUNDING_OF_MOTION * np.abs(loads.values * top.scale[top.held]).max(
            initial=0
        )
        floor = max(self.absolute, rounding) * float(values.law[:, 0].max())
        drag = system.damping if (system.damping[top.free_dofs] > 0).all() else top.scale**2
        return follow(
            loads.values, known, progress, bends, trusted, self.leaves, self.sense, system,
            workspace(system, self.threads), self.relative, floor, drag, branch, counts,
        )  # fmt: skip

    def _no_equilibrium(
        self, values: ConcreteParameters, states: Floats, fraction: float, loads: _Loads
    ) -> SimulationError:
        """Explains that no equilibrium was found beyond the last of the states."""
        top, output = self.topology, loads.output[loads.output < len(states) - 1]
        where = top.smallest_void_angles(values.void, states[-1].reshape(-1, 3)).argmin()
        unit = int(top.ligament_units[where, 0])
        return SimulationError(
            f"no equilibrium found beyond load {len(output)} of"
            f" {len(self.output_times)} (at {fraction:.3g} of"
            f" the way to the next; the narrowest void is at unit {unit}): jammed contact or no"
            " stable state; try a smaller load or more load steps",
            step=len(output),
            unit=unit,
            states=states[output],
        )

    @property
    def passed(self) -> Floats:
        """Lists the load parameters (n_times * substeps,) of loads; the path starts at zero."""
        way = np.diff(self.output_times, prepend=0.0)
        left = np.arange(self.substeps - 1, -1, -1) / self.substeps
        return (self.output_times[:, None] - way[:, None] * left).ravel()

    def _loads(self, drive: PrescribedMotion) -> _Loads:
        """Lists all loads that a path passes.

        What a structure does there depends on how far it was moved before: the peaks of a series
        between two output loads are passed as well.
        """
        stops: list[float] = []
        last = []
        found = drive.passed_peaks(self.output_times, self.topology.rotation_scale)
        for end, peaks in zip(self.output_times.tolist(), found, strict=True):
            stops += [*peaks.tolist(), end]
            last.append(len(stops) * self.substeps - 1)
        passed = replace(self, output_times=np.array(stops)).passed
        values = drive.values(self.topology.held, passed)
        return _Loads(values, passed, np.array(last, dtype=np.int64))

    def _path_curvature(self, states: Floats, output: Ints) -> tuple[Floats, Ints]:
        """Computes the departure of the start's path from its tangents, and where it may serve.

        The start knows the output loads alone, numbered in `output` (n_times,): its steps serve
        where no other load is passed between two of them.
        """
        start = self.start
        bends, trusted = np.zeros_like(states), np.zeros(len(states), dtype=np.int64)
        if start is None or start.states.shape != (len(output), states.shape[1]):
            return bends, trusted
        direct = np.diff(output, prepend=-1) == 1
        steps = np.diff(start.states, axis=0, prepend=0.0)
        bends[output[direct]] = (steps - start.tangents)[direct]
        trusted[output[direct]] = start.jumped[direct] == 0
        return bends, trusted

    def backward(
        self, values: ConcreteParameters, record: StaticRecord, bar_u: Floats, bar_v: Floats
    ) -> tuple[ConcreteParameters, Floats, Floats]:
        """See ``Solver``."""
        del bar_v
        top = record.topology or self.topology
        system = system_of(top, values)
        bars = empty_bars(system, (len(record.states), len(top.held)))
        work = workspace(system, self.threads)
        unstable = adjoint(record.states, bar_u, system, work, top.designed, bars)
        raise_new_pairs(system.contacts)
        if unstable >= 0:
            raise SimulationError(
                f"the equilibrium at load {unstable} is not a minimum of the energy, so it has no"
                " gradient to follow; try another design or more load steps",
                step=unstable,
            )
        return as_values(bars, top.n_units), self.output_times, bars.drive


class _Loads(NamedTuple):
    """Holds the loads of a path: those that are output, and others between them."""

    values: Floats  # (n_loads, n_held) of the held dofs
    passed: Floats  # (n_loads,) load parameters
    output: Ints  # (n_times,) numbers of the output ones


def _empty_branch(n_loads: int, n_dofs: int) -> Branch:
    states, tangents = (np.zeros((n_loads, n_dofs)) for _ in range(2))
    stable, jumped = (np.zeros(n_loads, dtype=np.int64) for _ in range(2))
    snapped, eigenvalue = (np.full(n_loads, np.nan) for _ in range(2))
    return Branch(
        states, tangents, stable, jumped, snapped, np.full(MOST_SNAPS, np.nan), eigenvalue
    )


def _clear(branch: Branch, known: int) -> None:
    """Clears what a branch holds beyond its first `known` loads but states."""
    branch.jumped[known:] = 0
    branch.snapped[known:] = np.nan
    branch.snaps[branch.snaps >= known] = np.nan


def _record(branch: Branch, counts: Ints, topology: Topology, loads: _Loads) -> StaticRecord:
    """Records the output loads of all that were passed."""
    passed, last = loads.passed, loads.output
    before, first = np.concatenate([[0.0], passed[:-1]]), np.append(0, last[:-1] + 1)
    snapped = before + branch.snapped * (passed - before)
    places = branch.snaps[np.isfinite(branch.snaps)]
    ways = np.minimum(places.astype(np.int64), len(before) - 1)
    return StaticRecord(
        branch.states[last].copy(),
        branch.tangents[last].copy(),
        branch.stable[last].copy(),
        _first_jumps(branch.jumped, last),
        np.fmax.reduceat(snapped, first),
        branch.eigenvalue[last].copy(),
        counts,
        topology,
        before[ways] + (places - ways) * (passed - before)[ways],
    )


def _first_jumps(jumped: Ints, last: Ints) -> Ints:
    """Selects the first kind of jump among the loads up to each output one, or 0."""
    ways = np.split(jumped, last[:-1] + 1)
    return np.array([way[(way > 0).argmax()] for way in ways], dtype=np.int64)
