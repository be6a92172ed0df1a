"""Runs stages that work in parts, and joins the parts."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from pipeline import datasets
from pipeline.datasets.tables import Kind
from pipeline.runtime import UserError


def run_or_gather(
    args: argparse.Namespace, run: Callable[[argparse.Namespace], None], kind: Kind, dim: str
) -> None:
    """Computes a part with ``run``, or joins all parts along ``dim``.

    Raises:
        UserError: there is no such part, or parts do not belong together.
    """
    if args.command == "run":
        if not 0 <= args.chunk < args.chunks:
            remedy = f"number the parts from zero; there are {args.chunks} (--chunks)"
            raise UserError("there is no such part", key="--chunk", value=args.chunk, remedy=remedy)
        run(args)
    else:
        join_parts(args.parts, kind, dim, args.out)


def join_parts(paths: Sequence[Path], kind: Kind, dim: str, out: Path) -> None:
    """Writes the parts as one dataset, in the order of ``dim``.

    Raises:
        UserError: a part belongs to another design or problem, or is there twice.
    """
    import xarray as xr

    parts = [datasets.read(path, kind) for path in paths]
    for path, read in zip(paths, parts, strict=True):
        for name, of in (("parents", "design"), ("problem_hash", "problem")):
            if read.attrs[name] != parts[0].attrs[name]:
                what = f"the part belongs to another {of}"
                raise UserError(what, file=path, remedy="remove it and run again")
    numbers = np.concatenate([read[dim].values for read in parts])
    if len(np.unique(numbers)) < len(numbers):
        raise UserError(
            "a part is there twice", file=out, remedy="give each part once", key="--parts"
        )
    whole = xr.concat(parts, dim=dim, combine_attrs="drop_conflicts").sortby(dim)
    datasets.write(whole, out, kind, dict(parts[0].attrs))
