"""Builds a target twice from nothing and compares all bytes.

Both builds have a results folder of their own in a temporary place, and these sources.
"""

import argparse
import logging
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from pipeline.datasets import file_hash
from pipeline.runtime import ROOT, UserError

LOG = logging.getLogger(__name__)

SOURCES = ("Snakefile", "experiments", "pipeline", "profiles", "reports", "sim")
PASSING = {"logs", ".journal"}
"""Folders that tell of a run, and are no results."""


def differences(first: Path, second: Path) -> tuple[int, list[str]]:
    """Counts the files of two folders, and names those that only one has or that differ."""
    ours, others = _files(first), _files(second)
    names = sorted(ours.keys() | others.keys())
    return len(names), [name for name in names if ours.get(name) != others.get(name)]


def _files(folder: Path) -> dict[str, str]:
    """Hashes every result below a folder, by name."""
    names = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return {
        name.as_posix(): file_hash(folder / name)
        for name in names
        if PASSING.isdisjoint(name.parts)
    }


def _built(target: str, folder: Path) -> Path:
    folder.mkdir()
    for name in SOURCES:
        (folder / name).symlink_to(ROOT / name)
    snakemake = str(Path(sys.executable).with_name("snakemake"))
    ended = subprocess.run([snakemake, target], cwd=folder, check=False)
    if ended.returncode != 0:
        raise UserError("the build failed", key=target, remedy=f"see why: snakemake {target}")
    return folder / "results"


def work(args: argparse.Namespace) -> None:
    """Builds twice and compares.

    Raises:
        UserError: a build fails, or files differ.
    """
    with TemporaryDirectory(prefix="reproduce_") as place:
        first, second = (_built(args.target, Path(place) / name) for name in ("first", "second"))
        count, apart = differences(first, second)
    if apart:
        what = f"{len(apart)} of {count} files differ between two builds: {', '.join(apart)}"
        remedy = "tell the developers, with this list and the versions in requirements.lock"
        raise UserError(what, key=args.target, remedy=remedy)
    LOG.info("%s: two builds have the same bytes (files compared: %d)", args.target, count)
