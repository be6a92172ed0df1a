"""Motions in time with shorter and shorter steps, and with contact on the distance of units."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pipeline.posing import law_comparison
from pipeline.posing.case_result import (
    CLEARANCE_STRIDE,
    PosedStructure,
    Times,
    structures_of,
    times_of,
)
from pipeline.posing.to_scene import scene_of
from pipeline.posing.verification import AS_RUN, CheckResult
from sim.core import Floats, SimulationError
from sim.energy import observe
from sim.scene import concrete_parameters, make_plan, objective, scales
from sim.solvers import solve_case
from sim.structure import clearance
from sim.time_integration import ExplicitRecord

if TYPE_CHECKING:
    import xarray as xr

    from pipeline.problem import Problem
    from sim.solvers import PrescribedMotion, Solver
    from sim.structure import ConcreteParameters

LOG = logging.getLogger(__name__)

HALVINGS = {AS_RUN: 0, "half the step": 1, "a quarter of the step": 2}
BY_DISTANCE = "contact on distance"

Runs = dict[str, list["Run"]]


class Run(NamedTuple):
    """A structure simulated under one load case.

    Attributes:
        solver: that took it.
        motion: (n_times, n_units, 3).
        record: the solver's.
    """

    solver: Solver
    motion: Floats
    record: Any

    @property
    def time_step(self) -> float:
        """Length of equal steps in s; NaN of a graded grid."""
        return self.record.steps.h if isinstance(self.record, ExplicitRecord) else np.nan

    def repeated(self, values: ConcreteParameters, drive: PrescribedMotion) -> Run:
        """With half the steps."""
        return _run(self.solver.refined(self.record), values, drive)


def _run(solver: Solver, values: ConcreteParameters, drive: PrescribedMotion) -> Run:

    motion, _, record = solve_case(solver, values, drive)
    return Run(solver, motion.reshape(len(solver.asked), -1, 3), record)


def trials(
    asked: Problem, folder: Path, design: xr.Dataset
) -> tuple[dict[str, dict[str, CheckResult]], dict[str, str]]:
    """Numbers by check and structure, and by check whether there are any or why not.

    Raises:
        SimulationError: a structure cannot be simulated as it was run.
    """
    structures = structures_of(scene_of(asked, folder), design)
    times = times_of(asked, structures["altered"].scene)
    runs = as_run = {name: _first(each, times) for name, each in structures.items()}
    found = {AS_RUN: _numbers(structures, runs, as_run, times)}
    status = {AS_RUN: "ok"}
    for check in (name for name, halvings in HALVINGS.items() if halvings):
        runs = {name: _halved(each, runs[name]) for name, each in structures.items()}
        found[check] = _numbers(structures, runs, as_run, times)
        status[check] = "ok"
    others = structures_of(scene_of(law_comparison.geometric(asked), folder), design)
    try:
        runs = {name: _first(each, times) for name, each in others.items()}
        found[BY_DISTANCE] = _numbers(others, runs, as_run, times)
        status[BY_DISTANCE] = "ok"
    except SimulationError as error:
        LOG.warning("%s: %s", BY_DISTANCE, error)
        status[BY_DISTANCE] = str(error)
    return found, status


def _first(structure: PosedStructure, times: Times) -> list[Run]:

    scene, vertices = structure
    plan = make_plan(scene, vertices, times.asked, every_case=True)
    values = concrete_parameters(scene, vertices)
    return [_run(plan.solver, values, drive) for drive in scene.drives]


def _halved(structure: PosedStructure, runs: list[Run]) -> list[Run]:

    scene, vertices = structure
    values = concrete_parameters(scene, vertices)
    return [run.repeated(values, drive) for run, drive in zip(runs, scene.drives, strict=True)]


def _numbers(
    structures: dict[str, PosedStructure], runs: Runs, as_run: Runs, times: Times
) -> dict[str, CheckResult]:
    first = next(iter(structures.values())).scene
    aims = [run.motion[times.integrated][:, first.region] for run in next(iter(runs.values()))]
    return {
        name: _of_structure(structure, runs[name], as_run[name], aims, times)
        for name, structure in structures.items()
    }


def _of_structure(
    structure: PosedStructure, runs: list[Run], as_run: list[Run], aims: list[Floats], times: Times
) -> CheckResult:

    scene, vertices = structure
    values = concrete_parameters(scene, vertices)
    mimics = scene.reference is not None
    measure = objective(scene, np.stack(aims) if mimics else None)
    motion = np.stack([run.motion for run in runs])
    inside = motion[:, times.integrated][:, :, scene.region]
    apart = motion[:, times.shown] - np.stack([run.motion for run in as_run])[:, times.shown]
    missed, size = ((each / scales(scene.lattice.spacing)) for each in (inside - aims, aims))
    seen = [observe(scene.topology, values, each) for each in motion[:, times.shown]]
    clear = [
        clearance(scene.lattice, vertices, each[::CLEARANCE_STRIDE])
        for each in motion[:, times.shown]
    ]
    return CheckResult(
        loss=float(scene.weights @ np.asarray(measure(motion[:, times.integrated], values))),
        departure=float(np.linalg.norm(apart[..., :2], axis=-1).max()),
        min_void_angle=min(float(each.void_angle.min()) for each in seen),
        gap=min(float(each.gap.min()) for each in clear),
        overlaps=max(int(each.overlaps.max()) for each in clear),
        contact_pairs=max(int(each.contact_pairs.max()) for each in seen),
        error=float(np.linalg.norm(missed) / np.linalg.norm(size)) if mimics else np.nan,
        time_step=max(run.time_step for run in runs),
    )
