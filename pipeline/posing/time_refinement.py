"""Repeats motions with shorter and shorter steps, and with the other law of contact."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.posing import law_comparison
from pipeline.posing.case_result import (
    CLEARANCE_STRIDE,
    PosedStructure,
    Times,
    structures_of,
    times_of,
)
from pipeline.posing.failures import StoppedError
from pipeline.posing.to_scene import scene_of
from pipeline.posing.verification import AS_RUN, CheckResult
from sim.core import Floats, SimulationError
from sim.energy import observe
from sim.scene import Response, mimicking, scales, simulate
from sim.structure import clearance
from sim.time_integration import ExplicitRecord

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

    from pipeline.problem import Problem

LOG = logging.getLogger(__name__)

HALVINGS = {AS_RUN: 0, "half the step": 1, "a quarter of the step": 2}
OTHER_LAW = {
    "angle": ("geometric", "contact on distance"),
    "geometric": ("angle", "contact on void angles"),
}
"""By the law of a study: the one that it is compared with, and the name of that check."""

Runs = dict[str, Response]


def trials(
    asked: Problem, folder: Path, design: xr.Dataset
) -> tuple[dict[str, dict[str, CheckResult]], dict[str, str]]:
    """Collects numbers by check and structure, and by check whether there are any or why not.

    Raises:
        StoppedError: a structure cannot be simulated as it was run.
    """
    structures = structures_of(scene_of(asked, folder), design)
    times = times_of(asked, structures["altered"].scene)
    runs = as_run = _as_posed(structures, times)
    found = {AS_RUN: _numbers(structures, runs, as_run, times)}
    status = {AS_RUN: "ok"}
    halved = [name for name, halvings in HALVINGS.items() if halvings]
    for place, check in enumerate(halved):
        try:
            runs = {name: run.refined() for name, run in runs.items()}
        except SimulationError as error:
            LOG.warning("%s: %s", check, error)
            status |= dict.fromkeys(halved[place:], str(error))  # shorter steps start from these
            break
        found[check] = _numbers(structures, runs, as_run, times)
        status[check] = "ok"
    law, check = OTHER_LAW[asked.contact.law]
    others = structures_of(scene_of(law_comparison.under(asked, law), folder), design)
    try:
        found[check] = _numbers(others, _as_posed(others, times), as_run, times)
        status[check] = "ok"
    except StoppedError as stopped:
        status[check] = f"{stopped.name}: {stopped}"
        LOG.warning("%s: %s", check, status[check])
    return found, status


def _as_posed(structures: Mapping[str, PosedStructure], times: Times) -> Runs:
    """Simulates structures with the steps that the solver takes by itself."""
    runs: Runs = {}
    for name, (scene, vertices) in structures.items():
        try:
            runs[name] = simulate(scene, vertices=vertices, times=times.asked)
        except SimulationError as error:
            raise StoppedError(error, scene, name, times.asked) from error
    return runs


def _time_step(run: Response) -> float:
    """Reads the longest of the equal steps of all cases, s; NaN of a graded grid."""
    steps = [r.steps.h if isinstance(r, ExplicitRecord) else np.nan for r in run.records]
    return float(np.max(steps))  # NaN if one is, wherever it stands


def relative_errors(motion: Floats, target: Floats, along: Floats) -> Floats:
    """Computes the relative L2 errors (n_cases,) of motions (n_cases, n_times, n_units, 3).

    Motions and targets are without units; their weighted mean is the error of a structure, since
    pooled squares would be ruled by the case that moves most.
    """
    missed, size = (
        np.trapezoid((each**2).sum(axis=(-2, -1)), along) for each in (motion - target, target)
    )
    return np.asarray(np.sqrt(missed / size))


def _numbers(
    structures: dict[str, PosedStructure], runs: Runs, as_run: Runs, times: Times
) -> dict[str, CheckResult]:
    first = next(iter(structures.values())).scene
    aims = next(iter(runs.values())).displacement[:, :, first.objective.region]
    return {
        name: _of_structure(structure, runs[name], as_run[name], aims, times)
        for name, structure in structures.items()
    }


def _of_structure(
    structure: PosedStructure, run: Response, as_run: Response, aims: Floats, times: Times
) -> CheckResult:

    scene, vertices = structure
    values, motion = run.parameters, run.displacement
    mimics = scene.objective.reference is not None
    measure = mimicking(scene, aims[:, times.integrated] if mimics else None)
    inside = motion[:, times.shown][:, :, scene.objective.region]
    apart = motion[:, times.shown] - as_run.displacement[:, times.shown]
    moved, aim = (each / scales(scene.lattice.spacing) for each in (inside, aims[:, times.shown]))
    weights, shown = np.asarray(scene.loads.case_weights), times.asked[times.shown]
    seen = [observe(scene.topology, values, each) for each in motion[:, times.shown]]
    clear = [
        clearance(scene.lattice, vertices, each[::CLEARANCE_STRIDE])
        for each in motion[:, times.shown]
    ]
    return CheckResult(
        loss=float(weights @ np.asarray(measure(motion[:, times.integrated], values))),
        departure=float(np.linalg.norm(apart[..., :2], axis=-1).max()),
        min_void_angle=min(float(each.void_angle.min()) for each in seen),
        gap=min(float(each.gap.min()) for each in clear),
        overlaps=max(int(each.overlaps.max()) for each in clear),
        contact_pairs=max(int(each.contact_pairs.max()) for each in seen),
        error=np.average(relative_errors(moved, aim, shown), weights=weights) if mimics else np.nan,
        time_step=_time_step(run),
    )
