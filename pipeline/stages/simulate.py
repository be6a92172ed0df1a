"""Stage: simulates the intact, altered and cloaked structures of a design, with error estimates."""

import argparse
import logging
from pathlib import Path
from typing import Any

import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import (
    CaseResult,
    PosedStructure,
    StoppedError,
    Times,
    assemble_response,
    law_comparison,
    measure,
    read_design,
    scene_of,
    structures_of,
    times_of,
    under_worst,
)
from pipeline.problem import Problem
from pipeline.runtime import cli
from sim.core import SimulationError
from sim.scene import Scene, cases_of, make_plan
from sim.solvers import run_batch

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Reads problem and design, simulates the structures, writes their response.

    Raises:
        UserError: a structure could not be followed to its end; what was computed is kept.
    """
    _partial_path(args).unlink(missing_ok=True)  # of a run before this one
    asked = problem.load(args.problem, args.preset)
    asked = law_comparison.under(asked, "geometric") if args.geometric else asked
    if args.certificate is not None:
        asked = under_worst(asked, datasets.read(args.certificate, "certificate"))
    design = read_design(asked, args.design)
    scene = scene_of(asked, args.problem.parent)
    structures = structures_of(scene, design)
    try:
        made, plans = response_dataset(asked, structures, args.threads)
    except StoppedError as stopped:
        kept = _write_partial(asked, structures, stopped, args)
        raise stopped.explain(asked, args.problem, kept) from stopped
    origin = provenance.of_study(asked, "simulate", parents=_parents(args), plan=plans)
    datasets.write(made, args.out, "response", origin)


def _parents(args: argparse.Namespace) -> dict[str, Path]:
    """Lists the datasets that a command line names, by role."""
    given = {"design": args.design, "certificate": args.certificate}
    return {role: path for role, path in given.items() if path is not None}


def _write_partial(
    asked: Problem,
    structures: dict[str, PosedStructure],
    stopped: StoppedError,
    args: argparse.Namespace,
) -> Path | None:
    """Writes the response of a static path as far as all structures can be followed, if at all."""
    scene, step = stopped.scene, stopped.error.step
    if not scene.loads.static or scene.objective.steps is None or not step:
        return None  # a step in time is the solver's own, of no use to others
    reached = stopped.asked[step - 1] / scene.loads.duration
    steps = int(scene.objective.steps * reached * (1 + 1e-9))
    if steps == 0:
        return None
    shorter = {
        name: each._replace(scene=_shorten(each.scene, steps)) for name, each in structures.items()
    }
    try:
        made, plans = response_dataset(asked, shorter, args.threads)
    except StoppedError as again:
        return _write_partial(asked, shorter, again, args)
    out = _partial_path(args)
    origin = provenance.of_study(asked, "simulate", parents=_parents(args), plan=plans)
    datasets.write(made, out, "response", origin)
    return out


def _partial_path(args: argparse.Namespace) -> Path:
    """Names the file for a response that could not be followed to its end."""
    out: Path = args.out
    return out.with_name(f"{out.stem}_partial.nc")


def _shorten(scene: Scene, steps: int) -> Scene:
    """Shortens a static scene to so many of its load steps."""
    assert scene.objective.steps is not None
    return scene.updated(
        duration=scene.loads.duration * steps / scene.objective.steps,
        steps=steps,
        reference=scene.objective.reference and _shorten(scene.objective.reference, steps),
    )


def response_dataset(
    asked: Problem, structures: dict[str, PosedStructure], threads: int
) -> tuple[xr.Dataset, dict[str, dict[str, Any]]]:
    """Makes the dataset ``response`` of the structures, and the plan of each.

    Raises:
        StoppedError: a structure could not be followed to its end.
    """
    times = times_of(asked, structures["altered"].scene)
    measured, plans = measured_cases(structures, times, threads)
    return assemble_response(asked, structures, times, measured), plans


def measured_cases(
    structures: dict[str, PosedStructure], times: Times, threads: int
) -> tuple[dict[str, list[CaseResult]], dict[str, dict[str, Any]]]:
    """Every case of every structure, and the plan of each structure.

    Raises:
        StoppedError: a structure cannot be simulated, or not be followed to its end.
    """
    measured: dict[str, list[CaseResult]] = {}
    plans: dict[str, dict[str, Any]] = {}
    n_cases = len(structures["altered"].scene.loads.motions)
    with cli.progress(len(structures) * n_cases, "response") as bar:
        for name, structure in structures.items():
            try:
                plan = make_plan(structure.scene, structure.vertices, times.asked, every_case=True)
            except SimulationError as error:
                raise StoppedError(error, structure.scene, name, times.asked) from error
            plans[name] = plan.record()
            LOG.info("%s: %s", name, plan.describe())
            cases = cases_of(structure.scene, structure.vertices, plan.solver)
            reduce = measure(structure, times, measured.get("intact"))
            measured[name] = []
            for outcome in run_batch(cases, reduce, threads):
                if outcome.value is None:
                    assert outcome.error is not None
                    raise StoppedError(outcome.error, structure.scene, name, times.asked)
                measured[name].append(outcome.value)
                bar.update(loss=outcome.value.loss)
    return measured, plans
