"""Stage: imperfect copies of the shipped design, simulated in parts that are then joined."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline import cli, problem
from pipeline.errors import UserError

LOG = logging.getLogger(__name__)


def parser() -> argparse.ArgumentParser:
    """The stage's command line."""
    made = cli.parser("pipeline.scatter", "Simulate imperfect copies of a design.", study=False)
    commands = made.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="simulate one part of the copies", allow_abbrev=False)
    run.add_argument("--problem", type=Path, required=True, metavar="YAML")
    run.add_argument("--preset", metavar="NAME")
    run.add_argument("--design", type=Path, required=True, metavar="NC", help="the design")
    run.add_argument("--chunk", type=int, required=True, help="number of this part, from zero")
    run.add_argument("--chunks", type=int, required=True, help="number of parts")
    run.add_argument("--threads", type=int, default=1, help="copies simulated side by side")
    gather = commands.add_parser("gather", help="join the parts", allow_abbrev=False)
    gather.add_argument("--parts", type=Path, nargs="+", required=True, metavar="NC")
    for command in (run, gather):
        command.add_argument("--out", type=Path, required=True, metavar="NC")
        command.add_argument("--log", type=Path, metavar="FILE", default=argparse.SUPPRESS)
        command.add_argument("--quiet", action="store_true", default=argparse.SUPPRESS)
    return made


def work(args: argparse.Namespace) -> None:
    """Simulates a part of the copies, or joins all parts."""
    if args.command == "run":
        _run(args)
    else:
        _gather(args)


def _run(args: argparse.Namespace) -> None:
    from pipeline import copies, datasets, provenance
    from pipeline.scenes import scene_of
    from pipeline.structures import flat_vertices

    asked = problem.load(args.problem, args.preset)
    if asked.robustness is None:
        raise UserError(
            "the problem asks for no imperfect copies",
            file=args.problem,
            key="robustness",
            remedy="add robustness.samples",
        )
    design = datasets.read(args.design, "design")
    scene = scene_of(asked, args.problem.parent)
    vertices = flat_vertices(scene.lattice, design["vertices"])
    samples = np.array_split(np.arange(asked.robustness.samples), args.chunks)[args.chunk]
    made = copies.simulate(scene, vertices, asked.robustness, list(samples), args.threads)
    LOG.info("%d of %d copies failed", int((made["status"] != "ok").sum()), made["status"].size)
    parents = {"design": args.design}
    origin = provenance.attributes(asked, "scatter", parents=parents)
    datasets.write(made, args.out, "scatter", origin)


def _gather(args: argparse.Namespace) -> None:
    import xarray as xr

    from pipeline import datasets

    parts = [datasets.read(path, "scatter") for path in args.parts]
    for path, read in zip(args.parts, parts, strict=True):
        if read.attrs["parents"] != parts[0].attrs["parents"]:
            raise UserError(
                "the part belongs to another design", file=path, remedy="remove it and run again"
            )
    whole = xr.concat(parts, dim="sample", combine_attrs="drop").sortby("sample")
    datasets.write(whole, args.out, "scatter", dict(parts[0].attrs))


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    return cli.run(work, parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
