"""Chooses what a crate holds of a folder of results: what is of the study's problem as it stands.

A section or method that has left the problem leaves its datasets and pages behind.
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path

from pipeline import datasets
from pipeline.posing import law_comparison
from pipeline.problem import Problem, outputs, over_measured_constants, section_hash
from pipeline.runtime import BUILD, REPORTED, ROOT, STAGES, UserError
from pipeline.workflow import recordings, studies


def leftovers(study: studies.Study, built: Path) -> list[Path]:
    """Lists the files and folders in a study's results that are not of its problem.

    Raises:
        UserError: its report shows one of them: the study is to be built again.
    """
    asked, found = studies.problem_of(study), []
    shown = [built / f"{name}.nc" for name in outputs(asked)]
    shown += [
        built / f"recordings/{name}/comparison.nc"
        for name in recordings.shown_recordings(str(study))
    ]
    present = [*built.glob("*.nc"), *built.glob("recordings/*/comparison.nc")]
    for path in sorted({*shown, *present}):
        made = datasets.read_attributes(path)
        if made.get("problem_hash") == _expected_hash(study, path.stem, str(made.get("kind"))):
            continue
        if path in shown:
            what = "it was made from another problem than the study's"
            value, remedy = made.get("problem_hash"), f"build it again: {BUILD} {study}"
            raise UserError(what, file=path, key="problem_hash", value=value, remedy=remedy)
        found += [path.parent] if path.stem == "comparison" else [path, path.with_suffix("")]
    packages = (path for path in built.glob("fabrication/*/manifest.json"))
    wanted = section_hash(asked, "fabricate")
    if any(json.loads(each.read_bytes()).get("problem_hash") != wanted for each in packages):
        found.append(built / "fabrication")
    return [path for path in found if path.exists()]


def _expected_hash(study: studies.Study, name: str, kind: str) -> str | None:
    """Hashes what a dataset of this name depends on; None if the study has none of the name."""
    asked = studies.problem_of(study)
    if (method := name.removeprefix("design_")) != name:
        known = method in asked.optimiser.methods.chosen
        return section_hash(asked, "design", method) if known else None
    name = re.sub(r"_\d+$", "", name)  # a part of it
    if name in outputs(asked):
        posed = _posed(asked, name, ROOT / study.problem)
        return section_hash(posed, REPORTED[name].name)
    return next((section_hash(asked, stage) for stage in _apart(name, kind)), None)


def _posed(asked: Problem, name: str, path: Path) -> Problem:
    """Poses the problem as a dataset that the report shows is made of it."""
    if name == "geometric_response":
        return law_comparison.under(asked, "geometric")
    return over_measured_constants(asked, path.parent) if name == "constants" else asked


def _apart(name: str, kind: str) -> Iterator[str]:
    """Lists the stages that make datasets of a kind which no study's report reads."""
    for stage in STAGES.values():
        if stage.kind == kind and name not in REPORTED and not stage.datasets:
            yield stage.name
