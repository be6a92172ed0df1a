"""Runs stages that work in parts, and joins the parts."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from pipeline import datasets
from pipeline.datasets.tables import Kind
from pipeline.runtime import UserError


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
    whole = xr.concat(parts, dim=dim, combine_attrs="drop_conflicts").sortby(dim)
    datasets.write(whole, out, kind, dict(parts[0].attrs))
