"""Finds snaps and loops of measured load cycles, beside equilibria along a drive's path."""

from pathlib import Path
from typing import NamedTuple, Self

import jax
import numpy as np
import xarray as xr

from pipeline.calibration.experiments import LoadBranch, Snap, load_cycles
from pipeline.calibration.inputs import Constants, CycleRecord, LoadCycles
from pipeline.problem.fields import csv_columns, units
from pipeline.runtime import UserError
from sim.core import Floats
from sim.energy import Observables, Topology, ligament_strain, observe, topology
from sim.quasistatics import StaticSolver, trace_first_snap
from sim.solvers import PrescribedMotion, TimeSeries, concrete, held_dofs, solve_case
from sim.structure import ConcreteParameters, Material, parameters_at

KNOWN = {"approach": units.LENGTH, "equilibrium": units.FORCE, "motion": units.FORCE}
"""Columns of what others found."""
CHECKED = (*KNOWN, "difference", "force")


class CyclePath(NamedTuple):
    """Holds equilibria over a whole cycle."""

    approach: Floats  # (n,) of the clamps, mm, there and back
    tension: Floats  # (n,) N: the slope of the energy over the approach, negative in compression
    energy: Floats  # (n,) stored, N mm
    turn: int  # number of the farthest equilibrium
    jumps: int  # number of times that the structure jumped
    # number of jumps at no limit point, but where a ligament has turned by half a turn against its
    # units and its law's shear force changes sign: no path leads on there
    reversals: int
    # (m, 2) approach, mm, and tension, N, along the path that the first jump leaves, not stable
    # from where the approach turns back to where it rises again; empty without a jump
    traced: Floats

    def compare(self, known: Floats) -> Floats:
        """Sets the slope of the energy beside that which others found.

        Args:
            known: (n, 2) approach, mm, and slope, N, there.

        Returns:
            (n, 2) the difference of the energy over two steps, as theirs, and the force, N.
        """
        way, at = slice(self.turn + 1), known[:, 0]
        approach, energy = (np.r_[0.0, each[way]] for each in (self.approach, self.energy))
        slope = np.interp(at, approach, np.gradient(energy, approach))
        return np.column_stack([slope, -np.interp(at, approach[1:], self.tension[way])])

    def with_play(self, play: float) -> Self:
        """Shifts the clamps by half their play, against the force that they transmit."""
        approach, tension = self.traced.T
        return self._replace(
            approach=self.approach - np.sign(self.tension) * play / 2,
            traced=np.column_stack([approach - np.sign(tension) * play / 2, tension]),
        )


def follow_cycle(asked: LoadCycles, record: CycleRecord, folder: Path) -> CyclePath:
    """Follows the equilibria of a specimen as its driven unit goes along the path and back.

    Raises:
        UserError: the path cannot be used.
        SimulationError: there is no equilibrium.
    """
    assert record.material is not None
    lattice = asked.lattice.network()
    wanted = {"ux": units.LENGTH, "uy": units.LENGTH, "approach": units.LENGTH}
    path = csv_columns.read_quantities(folder / asked.drive.file, wanted, 3)
    if not (np.diff(path[:, 2]) > 0).all():
        remedy = "give a path along which the clamps come nearer with every line"
        what = "the approach does not rise"
        raise UserError(what, file=folder / asked.drive.file, key="approach", remedy=remedy)
    begin = Constants(record.material, record.contact, asked.lattice.spacing)
    axial, shear, bending, translation, rotation = begin.numbers
    stiffness = 0.0 if record.contact is None else record.contact.stiffness
    made = Material(
        record.material.density, axial, shear, bending, stiffness, translation, rotation
    )
    values = concrete(parameters_at(lattice, lattice.vertices, made))
    units_held = (np.array([asked.drive.held]), np.array([asked.drive.driven]))
    fixed = topology(lattice, held_dofs(*units_held), begin.law)
    whole = np.concatenate([path, path[-2::-1]])
    direction = np.gradient(path[:, :2], path[:, 2], axis=0, edge_order=2)
    along = np.concatenate([direction, direction[-2::-1]])
    steps = np.arange(len(whole), dtype=float)
    motion = np.column_stack([whole[:, :2], np.zeros(len(whole))])
    drive = PrescribedMotion(units_held[1], TimeSeries(steps, motion))
    solver = StaticSolver(fixed, steps[1:])
    state, _, found = solve_case(solver, values, drive)

    def observe_path(loads: Floats, states: Floats) -> tuple[Observables, Floats]:
        seen = observe(fixed, values, states.reshape(len(states), fixed.n_units, 3))
        slope = np.column_stack([np.interp(loads, steps, each) for each in along.T])
        return seen, -(seen.force_on(units_held[1]) * slope).sum(axis=1)

    seen, tension = observe_path(steps[1:], state)
    past = trace_first_snap(solver, values, drive, found)
    loads, states = (found.snaps, found.states[:0]) if past is None else past[:2]
    traced = np.interp(loads, steps, whole[:, 2]), observe_path(loads, states)[1]
    return CyclePath(
        whole[1:, 2], tension, seen.strain_energy + seen.contact_energy, len(path) - 2,
        len(found.snaps), _reversals(fixed, values, state), np.column_stack(traced),
    )  # fmt: skip


def _reversals(fixed: Topology, values: ConcreteParameters, states: Floats) -> int:
    """Counts the steps in which a ligament turns through half a turn against its units."""
    ends = states.reshape(len(states), fixed.n_units, 3)[:, fixed.ligament_units]
    one = jax.vmap(ligament_strain)
    of_all = jax.jit(jax.vmap(one, in_axes=(0, 0, None, None, None)))
    arms = values.arm[:, 0], values.arm[:, 1]
    shear = np.asarray(of_all(ends[:, :, 0], ends[:, :, 1], *arms, values.vector).shear)
    return int((np.abs(np.diff(shear, axis=0)) > np.pi).any(axis=1).sum())


class MeasuredCycle(NamedTuple):
    """Holds the mean ways of a record's cycles, and what they tell."""

    closing: LoadBranch
    opening: LoadBranch
    scatter: tuple[Floats, Floats]
    snaps: tuple[list[Snap], list[Snap]]
    loops: Floats
    first: bool  # whether the means are over the first cycle as well


def measure_cycle(record: CycleRecord, folder: Path) -> MeasuredCycle:
    """Finds snaps and loops in a record.

    Raises:
        UserError: the file cannot be used, or holds no whole cycle.
    """
    path = folder / record.file
    wanted = {record.columns.displacement: units.LENGTH, record.columns.force: units.FORCE}
    branches = load_cycles.split_branches(*csv_columns.read_quantities(path, wanted, 10).T)
    reach = max((np.ptp(each.displacement) for each in branches), default=0.0)
    full = [
        each for each in branches if np.ptp(each.displacement) > load_cycles.LEAST_RANGE * reach
    ]
    first = record.first == "kept" or len(full) < 4
    kept = full if first else full[2:]
    ways = [[each for each in kept if each.loading == rises] for rises in (True, False)]
    if not all(ways):
        remedy = "give a record that goes there and back at least once"
        what = "no whole cycle is in the record"
        raise UserError(what, file=path, key=record.columns.displacement, remedy=remedy)
    (closing, scatter), (opening, other) = (load_cycles.mean_branch(each) for each in ways)
    snaps = load_cycles.find_snaps(closing), load_cycles.find_snaps(opening)
    loops = load_cycles.loop_areas(full)
    return MeasuredCycle(closing, opening, (scatter, other), snaps, loops, first)


def study_cycles(asked: LoadCycles, folder: Path) -> xr.Dataset:
    """Assembles the dataset of all records and of the equilibria beside them.

    Raises:
        UserError: a file cannot be used.
        SimulationError: there is no equilibrium.
    """
    curves: list[tuple[int, int, Floats, Floats, Floats]] = []
    snaps: list[tuple[int, int, Snap]] = []
    loops: list[tuple[int, float]] = []
    checks: list[Floats] = [np.empty((0, 1 + len(CHECKED)))]
    first = np.zeros(len(asked.records), np.int8)
    misfit, jumps, reversals = np.full((3, len(asked.records)), np.nan)
    for k, record in enumerate(asked.records):
        seen = measure_cycle(record, folder)
        first[k] = seen.first
        for role, branch in enumerate((seen.closing, seen.opening)):
            curves.append((k, role, branch.displacement, branch.force, seen.scatter[role]))
            snaps += [(k, role, each) for each in seen.snaps[role]]
        loops += [(k, float(area)) for area in seen.loops]
        if record.material is None:
            continue
        cycle = follow_cycle(asked, record, folder)
        shown, jumps[k], reversals[k] = cycle.with_play(record.play), cycle.jumps, cycle.reversals
        if record.known is not None:
            known = csv_columns.read_quantities(folder / record.known, KNOWN)
            number = np.full(len(known), k)
            checks.append(np.column_stack([number, known, cycle.compare(known[:, :2])]))
        misfit[k] = _misfit(shown, seen)
        for role, part in ((2, slice(cycle.turn + 1)), (3, slice(cycle.turn, None))):
            none = np.full(len(shown.tension[part]), np.nan)
            curves.append((k, role, shown.approach[part], shown.tension[part], none))
        curves.append((k, 4, *shown.traced.T, np.full(len(shown.traced), np.nan)))
    lengths = [len(each[2]) for each in curves]
    points = {
        "record_of_point": np.repeat([each[0] for each in curves], lengths),
        "role": np.repeat([each[1] for each in curves], lengths).astype(np.int8),
        "displacement": np.concatenate([each[2] for each in curves]),
        "force": np.concatenate([each[3] for each in curves]),
        "scatter": np.concatenate([each[4] for each in curves]),
    }
    ends = np.array([each[2] for each in snaps]).reshape(-1, 4)
    record_of_check, *check = np.concatenate(checks).T
    variables = {
        **{name: ("point", values) for name, values in points.items()},
        "record_of_snap": ("snap", np.array([each[0] for each in snaps], int)),
        "snap_role": ("snap", np.array([each[1] for each in snaps], np.int8)),
        "snap_start": ("snap", ends[:, 0]),
        "snap_peak": ("snap", ends[:, 1]),
        "snap_end": ("snap", ends[:, 2]),
        "snap_rest": ("snap", ends[:, 3]),
        "record_of_loop": ("loop", np.array([each[0] for each in loops], int)),
        "loop_area": ("loop", np.array([each[1] for each in loops])),
        "first": ("record", first),
        "misfit": ("record", misfit),
        "jumps": ("record", jumps),
        "reversals": ("record", reversals),
        "record_of_check": ("check", record_of_check.astype(int)),
        **{f"check_{name}": ("check", one) for name, one in zip(CHECKED, check, strict=True)},
        "play": ("record", np.array([record.play for record in asked.records])),
    }
    labels = {
        "record": [record.name for record in asked.records],
        "title": ("record", [record.title for record in asked.records]),
    }
    return xr.Dataset(variables, labels)


def _misfit(cycle: CyclePath, seen: MeasuredCycle) -> float:
    """Computes the root mean square, N, of the simulated less the measured ways, both averaged."""
    there = LoadBranch(True, cycle.approach[: cycle.turn + 1], cycle.tension[: cycle.turn + 1])
    back = LoadBranch(False, cycle.approach[cycle.turn :], cycle.tension[cycle.turn :])
    at = seen.closing.displacement
    ours = (there.at(at) + back.at(at)) / 2
    rest = ours - (seen.closing.force + seen.opening.at(at)) / 2
    return float(np.sqrt(np.nanmean(rest**2)))
