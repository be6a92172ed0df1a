"""Writes the metadata of a crate: its workflow, the problems that this ran, and what it made."""

import subprocess
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from rocrate.model import ContextEntity, Person
from rocrate.rocrate import ROCrate

from pipeline import datasets
from pipeline.datasets import provenance
from pipeline.runtime import ROOT
from pipeline.workflow.crates.publication import Publication

BUILT = "published"
"""Folder of the crate that holds what was made."""
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


def describe(asked: Publication, folder: Path) -> None:
    """Writes the metadata of a crate whose files are in place."""
    crate = ROCrate(version="1.1")  # what the profiles of runs extend
    root = crate.root_dataset
    for address, (name, number) in _PROFILES.items():
        profile = ContextEntity(crate, address, {"@type": "CreativeWork", "name": name})
        profile["version"] = number
        root.append_to("conformsTo", crate.add(profile))
    root["name"], root["description"] = asked.about
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
    problems = [_file(crate, folder, name, f"the problem, {name}") for name in asked.inputs]
    wanted = [_parameter(crate, Path(each.id).parent.name, "File", each) for each in problems]
    results = [
        _file(crate, folder, path.relative_to(folder).as_posix(), path.name)
        for path in sorted((folder / BUILT).rglob("*"))
        if path.is_file()
    ]
    made = [
        _parameter(crate, unquote(each.id.partition("/")[2]).removesuffix(".nc"), "File", each)
        for each in results
        if each.id.endswith(".nc") and each.id.count("/") == 2
    ]
    workflow["input"], workflow["output"] = wanted, made
    for path in sorted(folder.glob("*.lock")):
        _file(crate, folder, path.name, "pinned packages with hashes: make setup WHEELS=folder")
    for path in sorted(folder.iterdir()):
        if path.is_dir() and path.name != BUILT:
            crate.add_dataset(path, path.name, properties={"name": path.name})
    for path in sorted(folder.glob("experiments/**/LICENSE*")):
        _file(crate, folder, path.relative_to(folder).as_posix(), "licence of the files beside it")
    action = crate.add_action(
        workflow, "#run", object=problems, result=results, properties=_run(asked.target)
    )
    action["agent"] = author
    crate.metadata.write(folder)


def _run(target: str) -> dict[str, Any]:
    versions = ", ".join(f"{k} {v}" for k, v in provenance.package_versions().items())
    return {
        "name": f"make {target}",
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
    parameter = crate.add_formal_parameter(name, kind, identifier=f"#{quote(name)}")
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
