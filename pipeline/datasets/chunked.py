"""Runs stages in parts: their command line, and the joining of the parts."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from pipeline import datasets
from pipeline.datasets.tables import Kind
from pipeline.runtime import UserError, cli


def parser(stage: str, description: str) -> argparse.ArgumentParser:
    """Builds a command line with the commands `run` (one part) and `gather` (all of them)."""
    made = cli.parser(stage, description, study=False)
    commands = made.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="compute one part", allow_abbrev=False)
    run.add_argument("--problem", type=Path, required=True, metavar="YAML")
    run.add_argument("--preset", metavar="NAME")
    run.add_argument("--design", type=Path, required=True, metavar="NC", help="the design")
    run.add_argument("--chunk", type=int, required=True, help="number of this part, from zero")
    run.add_argument("--chunks", type=int, required=True, help="number of parts")
    run.add_argument("--threads", type=int, default=1, help="cases simulated side by side")
    gather = commands.add_parser("gather", help="join the parts", allow_abbrev=False)
    gather.add_argument("--parts", type=Path, nargs="+", required=True, metavar="NC")
    for command in (run, gather):
        command.add_argument("--out", type=Path, required=True, metavar="NC")
        command.add_argument("--log", type=Path, metavar="FILE", default=argparse.SUPPRESS)
        command.add_argument("--quiet", action="store_true", default=argparse.SUPPRESS)
    return made


def run_or_gather(
    args: argparse.Namespace, run: Callable[[argparse.Namespace], None], kind: Kind, dim: str
) -> None:
    """Computes a part with ``run``, or joins all parts along ``dim``."""
    if args.command == "run":
        run(args)
    else:
        join_parts(args.parts, kind, dim, args.out)


def join_parts(paths: Sequence[Path], kind: Kind, dim: str, out: Path) -> None:
    """Writes the parts as one dataset, in the order of ``dim``.

    Raises:
        UserError: a part belongs to another design.
    """
    import xarray as xr

    parts = [datasets.read(path, kind) for path in paths]
    for path, read in zip(paths, parts, strict=True):
        if read.attrs["parents"] != parts[0].attrs["parents"]:
            raise UserError(
                "the part belongs to another design", file=path, remedy="remove it and run again"
            )
    whole = xr.concat(parts, dim=dim, combine_attrs="drop").sortby(dim)
    datasets.write(whole, out, kind, dict(parts[0].attrs))
