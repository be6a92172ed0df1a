"""Builds a target twice from nothing and compares all bytes.

Both builds have a results folder of their own in a temporary place, and these sources.
"""

import argparse
import logging
import shutil
import subprocess
import tempfile
from pathlib import Path

from pipeline.datasets import file_hash
from pipeline.runtime import INSTALLED, ROOT, UserError
from pipeline.workflow.runs import SNAKEMAKE
from pipeline.workflow.studies import problem_of, requested
from pipeline.workflow.target_words import check_words

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
    ended = subprocess.run([*SNAKEMAKE, target], cwd=folder, check=False)
    if ended.returncode != 0:
        remedy = f"see its logs there, or why: snakemake {target}"
        raise UserError("the build failed", file=folder, key=target, remedy=remedy)
    return folder / "results"


def work(args: argparse.Namespace) -> None:
    """Builds twice and compares; both builds stay where they fail or differ.

    Raises:
        UserError: nothing is named so, a build fails, files differ, or there is no checkout.
    """
    if INSTALLED:
        what = "what is built twice are the studies of a checkout, which an installed package lacks"
        raise UserError(what, remedy="clone the repository, and there: make reproduce STUDY=name")
    check_words([args.target])
    for study in requested([args.target]):
        problem_of(study)
    place = Path(tempfile.mkdtemp(prefix="reproduce_"))
    LOG.info("building twice in %s, which stays if that fails", place)
    first, second = (_built(args.target, place / name) for name in ("first", "second"))
    count, apart = differences(first, second)
    if apart:
        what = f"{len(apart)} of {count} files differ between two builds: {', '.join(apart)}"
        remedy = "tell the developers, with this list and the versions in requirements.lock"
        raise UserError(what, file=place, key=args.target, remedy=remedy)
    shutil.rmtree(place)
    LOG.info("%s: two builds have the same bytes (files compared: %d)", args.target, count)
