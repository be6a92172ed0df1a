"""Publishes a built study as an RO-Crate from which it can be built again.

The crate follows the profile Workflow Run Crate 0.5: the workflow with its sources and locks, the
problem it ran, and what it made (https://w3id.org/ro/wfrun/workflow). Rebuilt in the crate's own
folder, results have the same bytes as those below `published/`.
"""

import argparse
import logging
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rocrate.model import ContextEntity, Person
from rocrate.rocrate import ROCrate

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.runtime import INSTALLED, ROOT, UserError, refusal
from pipeline.workflow.reproduce import PASSING, SOURCES
from pipeline.workflow.studies import Study, problem_of

LOG = logging.getLogger(__name__)

BUILT = "published"
"""Folder of the crate that holds what was made."""
_BESIDE = ("LICENSE", "CITATION.cff", "README.md", "Makefile", "pyproject.toml", "setup.py")
_LOCKS = ("requirements.lock", "requirements-dev.lock")
_FOLDERS = ("benchmarks", "docs", "metacloak")
_PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": ("Process Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/workflow/0.5": ("Workflow Run Crate", "0.5"),
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": ("Workflow RO-Crate", "1.0"),
}
_MIT = "https://spdx.org/licenses/MIT"
_FORMATS = {
    ".nc": "application/x-netcdf",
    ".csv": "text/csv",
    ".json": "application/json",
    ".html": "text/html",
    ".pdf": "application/pdf",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".mp4": "video/mp4",
    ".yaml": "application/yaml",
}
_NOT_SOURCES = shutil.ignore_patterns("__pycache__", "*.pyc", "*.egg-info")


def work(args: argparse.Namespace) -> None:
    """Writes the crate of a built study, whole or not at all.

    Raises:
        UserError: the study is not built, there is no checkout, or the folder cannot be written.
    """
    study = Study.parse(args.target)
    problem_of(study)  # faults of the problem first
    built = ROOT / "results" / str(study)
    if INSTALLED or not (built / "report/index.html").is_file():
        remedy = f"in a checkout, build it first: make {study}"
        raise UserError("there is no built study to publish", file=built, remedy=remedy)
    check_commits(built)
    out = built.with_name(f"{study}_crate") if args.out_dir is None else args.out_dir
    if out.exists():
        raise UserError("the folder is there already", file=out, remedy="remove it, or --out-dir")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=out.parent, prefix=f".{out.name}_") as place:
            aside = Path(place) / "crate"
            copy_sources(aside)
            shutil.copytree(built, aside / BUILT, ignore=shutil.ignore_patterns(*PASSING))
            describe(study, aside)
            aside.rename(out)
    except OSError as error:
        raise refusal(out, error) from error
    LOG.info("crate: %s", out)


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


def copy_sources(folder: Path) -> None:
    """Copies what builds the study, with the commit that its datasets are to name."""
    folder.mkdir()
    for name in (*SOURCES, *_FOLDERS, *_BESIDE, *_LOCKS):
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=_NOT_SOURCES)
        else:
            shutil.copy2(ROOT / name, folder / name)
    (folder / provenance.COMMIT_FILE).write_text(provenance.git_commit() + "\n")


def describe(study: Study, folder: Path) -> None:
    """Writes the metadata of a crate whose files are in place."""
    asked = problem_of(study)
    crate = ROCrate(version="1.1")  # what the profiles of runs extend
    root = crate.root_dataset
    for address, (name, number) in _PROFILES.items():
        profile = ContextEntity(crate, address, {"@type": "CreativeWork", "name": name})
        profile["version"] = number
        root.append_to("conformsTo", crate.add(profile))
    root["name"] = f"{asked.title} ({study})"
    root["description"] = asked.doc or asked.title
    root["datePublished"] = _committed()
    licence = {"@type": "CreativeWork", "name": "MIT License", "identifier": "MIT"}
    root["license"] = crate.add(ContextEntity(crate, _MIT, licence))
    author = crate.add(Person(crate, "#authors", {"name": "The metacloak contributors"}))
    root["author"] = author
    workflow = crate.add_workflow(
        folder / "Snakefile", "Snakefile", main=True, lang="snakemake", gen_cwl=False
    )
    workflow["name"] = "metacloak"
    workflow["version"] = provenance.git_commit()
    problem = _file(crate, folder, study.problem, f"the problem, {study}")
    wanted = _parameter(crate, "problem", "File", problem)
    results = [
        _file(crate, folder, path.relative_to(folder).as_posix(), path.name)
        for path in sorted((folder / BUILT).rglob("*"))
        if path.is_file()
    ]
    made = [
        _parameter(crate, Path(each.id).stem, "File", each)
        for each in results
        if each.id.endswith(".nc") and each.id.count("/") == 1
    ]
    workflow["input"], workflow["output"] = [wanted], made
    for name in _LOCKS:
        _file(crate, folder, name, "pinned packages with hashes: make setup WHEELS=folder")
    for name in (*SOURCES, *_FOLDERS):
        if (folder / name).is_dir():
            crate.add_dataset(folder / name, name, properties={"name": name})
    for path in sorted(folder.glob("experiments/**/LICENSE*")):
        _file(crate, folder, path.relative_to(folder).as_posix(), "licence of the files beside it")
    action = crate.add_action(
        workflow, "#run", object=[problem], result=results, properties=_run(study)
    )
    action["agent"] = author
    crate.metadata.write(folder)


def _run(study: Study) -> dict[str, Any]:
    versions = ", ".join(f"{k} {v}" for k, v in provenance.package_versions().items())
    return {
        "name": f"make {study}",
        "description": versions,
        "endTime": _committed(),
        "actionStatus": "http://schema.org/CompletedActionStatus",
    }


def _file(crate: ROCrate, folder: Path, name: str, told: str) -> ContextEntity:
    known = crate.dereference(name)
    if known is not None:
        return known
    path = folder / name
    about = {"name": told, "contentSize": str(path.stat().st_size)}
    about["sha256"] = provenance.file_hash(path)
    if path.suffix == ".nc":
        about["name"], about["keywords"] = _title_and_origin(path)
    if form := _FORMATS.get(path.suffix):
        about["encodingFormat"] = form
    return crate.add_file(path, name, properties=about)


def _parameter(crate: ROCrate, name: str, kind: str, example: ContextEntity) -> ContextEntity:
    parameter = crate.add_formal_parameter(name, kind, identifier=f"#{name}")
    parameter["workExample"] = example
    example["exampleOfWork"] = parameter
    return parameter


def _title_and_origin(path: Path) -> tuple[str, str]:
    """Tells what a dataset is, and whether it was measured, rendered (synthetic) or simulated."""
    read = datasets.read_attributes(path)
    origin = {"yes": "synthetic", "no": "measured"}.get(str(read.get("synthetic")), "simulated")
    return str(read.get("title", path.name)), origin


def _committed() -> str:
    """Tells when the sources were committed: a run has no date of its own, for equal bytes."""
    words = ["git", "-C", str(ROOT), "show", "-s", "--format=%cI", "HEAD"]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    return ended.stdout.strip() or "1970-01-01T00:00:00+00:00"
