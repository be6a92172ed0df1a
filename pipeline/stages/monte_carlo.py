"""Stage: imperfect copies of the shipped design, simulated in parts that are then joined."""

import argparse
import logging

import numpy as np

from pipeline import datasets, problem
from pipeline.datasets import chunked, provenance
from pipeline.posing import (
    StoppedError,
    loss_units,
    perturbed,
    read_design,
    scene_of,
    structures_of,
)
from pipeline.runtime import UserError

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Simulates a part of the copies, or joins all parts."""
    chunked.run_or_gather(args, _run, "scatter", "sample")


def _run(args: argparse.Namespace) -> None:
    asked = problem.load(args.problem, args.preset)
    if asked.robustness is None:
        what = "the problem asks for no imperfect copies"
        raise UserError(what, file=args.problem, key="robustness", remedy="add robustness.samples")
    design = read_design(asked, args.design)
    scene, vertices = structures_of(scene_of(asked, args.problem.parent), design)["cloaked"]
    count = asked.robustness.samples
    if args.chunks > count:
        what = f"there are no more parts than copies ({count})"
        remedy = f"give {count} or less, or raise robustness.samples"
        raise UserError(what, key="--chunks", value=args.chunks, remedy=remedy)
    samples = np.array_split(np.arange(count), args.chunks)[args.chunk]
    try:
        made = perturbed.simulate(scene, vertices, asked.robustness, list(samples), args.threads)
    except StoppedError as stopped:
        raise stopped.explain(asked, args.problem) from stopped
    made["loss"].attrs["units"] = loss_units(asked)
    LOG.info("%d of %d copies failed", int((made["status"] != "ok").sum()), made["status"].size)
    parents = {"design": args.design}
    origin = provenance.of_study(asked, "monte_carlo", parents=parents)
    datasets.write(made, args.out, "scatter", origin)
