"""Stage: the losses of a design and of the altered structure over a sweep, in parts then joined."""

import argparse
import hashlib
import logging
from collections.abc import Sequence

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import chunked, provenance
from pipeline.posing import loss_units, read_design, setting_losses
from pipeline.problem import Problem
from pipeline.problem.sections import DirectionGroup, SettingValue, split_value, sweep_cases
from pipeline.runtime import CaseLog, SweepResult, UserError, case_log, cli, source_hash
from sim.core import SimulationError

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Computes a part of the cases, or joins all parts; or computes those of measured constants."""
    if args.command == "constants":
        _run_constants(args)
    else:
        chunked.run_or_gather(args, _run, "sweep", "case")


def _run(args: argparse.Namespace) -> None:
    asked = problem.load(args.problem, args.preset)
    if asked.sweep is None:
        what = "the problem asks for no sweep"
        remedy = "add sweep.grid, sweep.list or sweep.random"
        raise UserError(what, file=args.problem, key="sweep", remedy=remedy)
    _compute(args, asked, args.chunk, args.chunks)


def _run_constants(args: argparse.Namespace) -> None:
    asked = problem.load(args.problem, args.preset)
    if asked.report.measured_constants is None:
        what = "the problem names no measured constants"
        remedy = "name their file: report.measured_constants.file"
        raise UserError(what, file=args.problem, key="report.measured_constants", remedy=remedy)
    _compute(args, problem.over_measured_constants(asked, args.problem.parent), 0, 1)


def _compute(args: argparse.Namespace, asked: Problem, chunk: int, chunks: int) -> None:
    assert asked.sweep is not None
    design = read_design(asked, args.design)
    parents = {"design": args.design}
    words = (problem.section_hash(asked, "sweep"), source_hash("pipeline.stages.sweep"))
    key = hashlib.sha256(" ".join((*words, provenance.file_hash(args.design))).encode())
    folder = args.out.parent / ".journal" / f"sweep_{key.hexdigest()[:16]}"
    here = sweep_cases.select_groups(asked.sweep, chunk, chunks)
    found = case_log.known(folder)
    path = folder / f"part_{chunk}.csv"
    with case_log.CaseLog(path, asked.sweep.keys) as log:
        LOG.info("results as they come: %s", path)
        _simulate(args, asked, design, here, found, log)
    made = dataset(asked, [case for group in here for case in group.cases], found)
    LOG.info("%d of %d cases failed", int((made["status"] != "ok").sum()), made.sizes["case"])
    origin = provenance.of_study(asked, "sweep", parents=parents)
    datasets.write(made, args.out, "sweep", origin)


def _simulate(
    args: argparse.Namespace,
    asked: Problem,
    design: xr.Dataset,
    groups: Sequence[DirectionGroup],
    found: dict[int, SweepResult],
    log: CaseLog,
) -> None:
    """Adds what is missing to ``found`` and to the case log."""
    failed = 0
    with cli.progress(sum(len(group.numbers) for group in groups), "cases") as bar:
        for group in groups:
            if not found.keys() >= set(group.numbers):
                rows = _group_results(args, asked, design, group)
                found.update(zip(group.numbers, rows, strict=True))
                words = [list(each.values()) for each in group.settings]
                log.add(zip(group.numbers, words, rows, strict=True))
            for number in group.numbers:
                failed += found[number].status != "ok"
                bar.update(failed=failed)


def _group_results(
    args: argparse.Namespace, asked: Problem, design: xr.Dataset, group: DirectionGroup
) -> list[SweepResult]:
    setting = group.together
    try:
        found, weights = setting_losses.results(
            asked, setting, args.problem.parent, design, args.threads
        )
    except (setting_losses.UnposedError, SimulationError) as error:
        return [SweepResult.failed(str(error))] * len(group.numbers)
    if sweep_cases.names_directions(setting):
        return found
    return [setting_losses.mean(found, weights)]


def dataset(
    asked: Problem,
    cases: Sequence[tuple[int, dict[str, SettingValue]]],
    found: dict[int, SweepResult],
) -> xr.Dataset:
    """Makes the dataset ``sweep`` of some cases."""
    assert asked.sweep is not None
    keys = asked.sweep.keys
    numbers = [number for number, _ in cases]
    words = [[setting[key] for key in keys] for _, setting in cases]
    values = [[(split_value(word) or (np.nan,))[0] for word in row] for row in words]
    of_case = {
        name: ("case", [getattr(found[number], name) for number in numbers])
        for name in ("loss", "loss_altered", "min_void_angle", "status")
    }
    both = ("case", "parameter")
    made = xr.Dataset(
        {
            **of_case,
            "value": (both, np.array(values)),
            "setting": (both, np.array([[str(word) for word in row] for row in words])),
        },
        {
            "case": numbers,
            "parameter": list(keys),
            "parameter_units": (
                "parameter",
                [sweep_cases.parameter_unit(asked.sweep, key) for key in keys],
            ),
        },
    )
    for name in ("loss", "loss_altered"):
        made[name].attrs["units"] = loss_units(asked)
    return made
