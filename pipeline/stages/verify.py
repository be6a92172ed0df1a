"""Stage: a design under finer steps of load, or of time and other contact, beside those as run."""

import argparse
import logging
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import (
    AS_RUN,
    UNSTABLE,
    CaseResult,
    CheckResult,
    StoppedError,
    assemble_verification,
    loss_units,
    read_design,
    scene_of,
    structures_of,
    time_refinement,
    times_of,
)
from pipeline.problem import Problem
from pipeline.runtime import UserError
from pipeline.stages.simulate import measured_cases

LOG = logging.getLogger(__name__)

Table = dict[str, list[CaseResult]]

FINER = (2, 10)
"""Factors of the number of load steps that the loss is checked with."""


def work(args: argparse.Namespace) -> None:
    """Simulates the structures of a design under every variant of the problem."""
    asked = problem.load(args.problem, args.preset)
    if asked.static and asked.horizon.steps is None:
        what = "the loss of this problem is not taken on load steps"
        remedy = "give horizon.steps, or leave the check out"
        raise UserError(what, file=args.problem, key="horizon.steps", remedy=remedy)
    design = read_design(asked, args.design)
    try:
        made = checks(asked, args.problem.parent, design, args.threads)
    except StoppedError as stopped:
        raise stopped.explain(asked, args.problem) from stopped
    origin = provenance.of_study(asked, "verify", parents={"design": args.design})
    datasets.write(made, args.out, "verification", origin)


def variants(asked: Problem) -> dict[str, Problem]:
    """Lists the problem as run, then its variants; all show the loads of the run."""
    steps = asked.horizon.steps
    assert steps is not None
    shown = asked.response.model_copy(update={"samples": steps + 1})
    as_run = asked.model_copy(update={"response": shown})
    finer = {f"{times} x load steps": steps * times for times in FINER}
    return {
        AS_RUN: as_run,
        **{
            name: as_run.model_copy(
                update={"horizon": asked.horizon.model_copy(update={"steps": count})}
            )
            for name, count in finer.items()
        },
    }


def checks(asked: Problem, folder: Path, design: xr.Dataset, threads: int = 1) -> xr.Dataset:
    """Makes the dataset ``verification``; a variant that cannot be simulated keeps its reason.

    Raises:
        StoppedError: a structure cannot be simulated as it was run.
    """
    found, status = (
        _finer_loads(asked, folder, design, threads)
        if asked.static
        else time_refinement.trials(asked, folder, design)
    )
    made = assemble_verification(found, status)
    made["loss"].attrs["units"] = loss_units(asked)
    return made


def _finer_loads(
    asked: Problem, folder: Path, design: xr.Dataset, threads: int
) -> tuple[dict[str, dict[str, CheckResult]], dict[str, str]]:
    """Numbers by check and structure of a path of equilibria, and why a check has none."""
    posed = variants(asked)
    tables: dict[str, Table] = {}
    status = dict.fromkeys(posed, "ok")
    for name, variant in posed.items():
        structures = structures_of(scene_of(variant, folder), design)
        times = times_of(variant, structures["altered"].scene)
        try:
            tables[name], _ = measured_cases(structures, times, threads)
        except StoppedError as stopped:
            if name == AS_RUN:
                raise
            status[name] = f"{stopped.name}: {stopped}"
            LOG.warning("%s: %s", name, status[name])
    as_run = tables[AS_RUN]
    found = {
        name: {
            structure: _check_result(
                cases, as_run[structure], asked, _loss_scale(asked, posed[name])
            )
            for structure, cases in table.items()
        }
        for name, table in tables.items()
    }
    return found, status


def _loss_scale(asked: Problem, variant: Problem) -> float:
    """Scales the loss of a variant to be comparable: that of mimicking is a sum over the steps."""
    mimics = asked.objective.target == "intact" and asked.objective.kind == "displacement"
    assert asked.horizon.steps is not None
    assert variant.horizon.steps is not None
    return float(np.sqrt(asked.horizon.steps / variant.horizon.steps)) if mimics else 1.0


def _check_result(
    cases: list[CaseResult], as_run: list[CaseResult], asked: Problem, share: float
) -> CheckResult:
    apart = [
        np.linalg.norm((one.displacement - other.displacement)[..., :2], axis=-1).max()
        for one, other in zip(cases, as_run, strict=True)
    ]
    return CheckResult(
        loss=share * float(np.dot(asked.drive.case_weights, [case.loss for case in cases])),
        departure=float(max(apart)),
        min_void_angle=min(float(case.observables.void_angle.min()) for case in cases),
        gap=min(float(np.nanmin(case.gap)) for case in cases),
        overlaps=max(int(np.nanmax(case.overlapping)) for case in cases),
        contact_pairs=max(int(case.observables.contact_pairs[-1]) for case in cases),
        unstable=sum(int((case.stability == UNSTABLE).sum()) for case in cases),
    )
