"""Publishes a built study as an RO-Crate from which it can be built again.

The crate follows the profile Workflow Run Crate 0.5: the workflow with its sources and locks, the
problem it ran, and what it made (https://w3id.org/ro/wfrun/workflow). Rebuilt in the crate's own
folder, `results/STUDY` has the same bytes as `published/STUDY`.
"""

import argparse
import logging
import shutil
import subprocess
from collections.abc import Collection
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.problem import content_hash
from pipeline.runtime import INSTALLED, ROOT, UserError, refusal
from pipeline.workflow.crates import (
    BUILT,
    SCHEMA,
    Publication,
    describe,
    leftovers,
    named_outside,
)
from pipeline.workflow.reproduce import PASSING, SOURCES
from pipeline.workflow.studies import problem_of

LOG = logging.getLogger(__name__)

_BESIDE = ("LICENSE", "CITATION.cff", "README.md", "Makefile", "pyproject.toml", "setup.py")
_LOCKS = ("requirements.lock", "requirements-dev.lock", "requirements-compiler.lock")
_FOLDERS = ("benchmarks", "docs", "metacloak")
_NOT_SOURCES = shutil.ignore_patterns("__pycache__", "*.pyc", "*.egg-info")


def work(args: argparse.Namespace) -> None:
    """Writes the crate of a built study or figure, whole or not at all.

    Raises:
        UserError: it is not built, there is no checkout, or the folder cannot be written.
    """
    if INSTALLED:
        what = "a crate holds the sources of a checkout, which an installed package lacks"
        raise UserError(what, remedy="clone the repository, and there: make publish STUDY=name")
    asked = Publication.of(args.target)
    default = ROOT / "results" / f"{asked.target}_crate"
    out = default if args.out_dir is None else args.out_dir
    check_place(out)
    check_sources()
    if args.check:
        return
    check_results(asked)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=out.parent, prefix=f".{out.name}_") as place:
            aside = Path(place) / "crate"
            copy_sources(asked, aside)
            copy_results(asked, aside)
            describe(asked, aside)
            aside.rename(out)
    except OSError as error:
        raise refusal(out, error) from error
    LOG.info("crate: %s", out)


def check_place(out: Path) -> None:
    """Checks that the folder of a crate is not there yet.

    Raises:
        UserError: it is.
    """
    if out.exists():
        raise UserError("the folder is there already", file=out, remedy="remove it, or --out-dir")


def check_results(asked: Publication) -> None:
    """Checks that a page is built, of the problems as they stand, and by these sources.

    Raises:
        UserError: it is not.
    """
    page = ROOT / "results" / asked.target / "report/index.html"
    if not page.is_file():
        remedy = f"build it first: make {asked.target}"
        raise UserError("there is no built study to publish", file=page, remedy=remedy)
    check_page(asked, page)
    for name in asked.folders:
        check_commits(ROOT / "results" / name)


def check_page(asked: Publication, page: Path) -> None:
    """Checks that a page was drawn of the problems as they stand: it names their hashes.

    Raises:
        UserError: it was not.
    """
    text = page.read_text(encoding="utf-8")
    for study in asked.studies:
        if (wanted := content_hash(problem_of(study))) not in text:
            what, remedy = "the page shows another problem", f"build it again: make {asked.target}"
            raise UserError(what, file=page, key="problem_hash", value=wanted, remedy=remedy)


def check_sources(root: Path = ROOT) -> None:
    """Checks that the commit that the crate will name is that of its sources.

    Studies may differ: the crate holds them as they are.

    Raises:
        UserError: a file differs, or git cannot tell: there is no checkout, or it is a crate.
    """
    if (root / provenance.COMMIT_FILE).exists() or not provenance.head_commit(root):
        what = "git knows of no commit of these sources"
        remedy = "publish from a clone of the repository: unpacked sources have no history"
        raise UserError(what, file=root, remedy=remedy)
    names = [name for name in SOURCES if name != "experiments"]
    words = ["git", "-C", str(root), "status", "--porcelain", "--", *names]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        what = f"git does not tell whether the sources are as committed: {done.stderr.strip()}"
        raise UserError(what, file=root, remedy=f"see: git -C {root} status")
    if told := done.stdout.splitlines():
        what = f"{len(told)} files of the sources are not as committed"
        remedy = "commit them (or set them aside: git stash -u), and build again"
        raise UserError(what, file=root / told[0][3:], remedy=remedy)


def check_commits(built: Path) -> None:
    """Checks that all datasets name the commit of these sources.

    Raises:
        UserError: one does not.
    """
    for path in sorted(built.rglob("*.nc")):
        commit = str(datasets.read_attributes(path).get("git_commit"))
        if commit != provenance.git_commit():
            remedy = f"build it again from nothing: remove {built}"
            what = "it was made by other sources than these"
            raise UserError(what, file=path, key="git_commit", value=commit, remedy=remedy)


def copy_sources(asked: Publication, folder: Path) -> None:
    """Copies what builds the studies, with the commit that their datasets are to name."""
    folder.mkdir()
    homes = {str(Path(name).parent) for name in asked.inputs}
    outside = {str(path) for study in asked.studies for path in named_outside(study)}
    there = [name for name in _FOLDERS if (ROOT / name).is_dir()]  # none of which a build needs
    studies = sorted(homes | outside | {str(SCHEMA)})
    for name in (*set(SOURCES) - {"experiments"}, *studies, *there, *_BESIDE, *_LOCKS):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=_NOT_SOURCES, dirs_exist_ok=True)
        else:
            shutil.copy2(ROOT / name, folder / name)
    (folder / provenance.COMMIT_FILE).write_text(provenance.git_commit() + "\n")


def copy_results(asked: Publication, folder: Path) -> None:
    """Copies what was made, without what tells of a run or is of no problem any more.

    Raises:
        UserError: what a report shows is not of the study's problem.
    """
    studies = {str(study): study for study in asked.studies}
    for name in asked.folders:
        built = ROOT / "results" / name
        if name in studies:
            left = leftovers(studies[name], built)
        else:  # of a page of several studies, which has no datasets of its own
            left = [path for path in built.iterdir() if path.name not in ("report", *PASSING)]
        for path in left:
            LOG.warning("left out, as it is not of the study's problem: %s", path)
        shutil.copytree(built, folder / BUILT / name, ignore=partial(_passed_over, left))


def _passed_over(left: Collection[Path], folder: str, names: list[str]) -> set[str]:
    return {name for name in names if name in PASSING or Path(folder, name) in left}
