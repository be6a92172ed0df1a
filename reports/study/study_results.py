"""Describes a study as a report sees it: its problem and the datasets that its stages made."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import cast

import numpy as np
import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.datasets.tables import Kind
from pipeline.posing import law_comparison
from pipeline.problem import Output, Problem
from pipeline.runtime import REPORTED, UserError
from reports.study import draft, recorded_motion, report_scene
from reports.study.recorded_motion import RecordedMotion
from reports.study.report_scene import ReportScene


def evaluation_count(design: xr.Dataset) -> int:
    """Counts the evaluations of a design, or of one of its methods, those that failed as well."""
    return int(np.isfinite(design["violation"]).sum())


def angle_budget(problem: Problem) -> int:
    """Returns the evaluations by the angle law that come before a descent, at most; 0 if none."""
    first = problem.optimiser.angle
    asked = problem.contact.law == "geometric" and problem.optimiser.methods.sqp is not None
    return first.evaluations if asked and first is not None else 0


def undrawn_evaluations(problem: Problem, design: xr.Dataset) -> tuple[int, int]:
    """Returns evaluations by the angle law before the history of SQP, and descents beside it."""
    descents = json.loads(design.attrs["plan"]).get("descents", [])
    return angle_budget(problem), max(0, len(descents) - 1)


@dataclass(frozen=True)
class RedesignResults:
    """Holds the design for contact on distance, and what the structures do with that contact."""

    design: xr.Dataset
    response: xr.Dataset

    @property
    def evaluations(self) -> int:
        """Returns number of evaluations of the second optimisation."""
        return evaluation_count(self.design)

    @property
    def changed(self) -> bool:
        """Tells whether there was a second optimisation."""
        return self.design.sizes["evaluation"] > 1


@dataclass(frozen=True)
class StudyResults:
    """Holds problem, datasets by kind, where they are from, and why this is but a draft.

    `name` is that of the study's folder and of its figure; `files` are hashes of the datasets;
    `compared` are its recordings beside their simulation, by name; `others` are datasets that a
    page shows besides.
    """

    name: str
    preset: str | None
    problem: Problem
    datasets: dict[Output, xr.Dataset]
    files: dict[str, str]
    draft: tuple[str, ...] = ()
    compared: Mapping[str, xr.Dataset] = field(default_factory=dict)
    others: Mapping[str, xr.Dataset] = field(default_factory=dict)

    @cached_property
    def recordings(self) -> list[RecordedMotion]:
        """Returns the recordings along the study's course."""
        return recorded_motion.recordings(self.problem, self.response, self.compared)

    @cached_property
    def scene(self) -> ReportScene:
        """Returns the harmonically driven lattice of the problem.

        Raises:
            UserError: the drive is not harmonic.
        """
        return report_scene.scene_of_problem(self.problem)

    @property
    def target(self) -> str:
        """Tells what builds the study, and the name of its folder of results."""
        return self.name if self.preset is None else f"{self.name}@{self.preset}"

    @property
    def design(self) -> xr.Dataset:
        """Returns the shipped design with the histories of all methods."""
        return self.datasets["design"]

    @property
    def response(self) -> xr.Dataset:
        """Tells what the structures do."""
        return self.datasets["response"]

    @property
    def as_built(self) -> StudyResults | None:
        """Returns the study with the response as built, if the report asks for it."""
        if "built" not in self.datasets:
            return None
        apart = {"built", "constants", "scatter", "verification"}
        kept = {name: data for name, data in self.datasets.items() if name not in apart}
        return replace(self, datasets=kept | {"response": self.datasets["built"]}, compared={})

    @property
    def sweep(self) -> xr.Dataset:
        """Returns the losses over parameters, of a problem that asks for them."""
        return self.datasets["sweep"]

    @property
    def constants(self) -> xr.Dataset | None:
        """Returns the losses over measured constants, if the report names any."""
        return self.datasets.get("constants")

    @property
    def scatter(self) -> xr.Dataset | None:
        """Returns imperfect copies of the design, if the problem asks for them."""
        return self.datasets.get("scatter")

    @property
    def verification(self) -> xr.Dataset | None:
        """Returns the design under finer load steps and another law, of a study on load steps."""
        return self.datasets.get("verification")

    @property
    def redesign(self) -> RedesignResults | None:
        """Returns the design for contact on distance, of a static study by the angle law."""
        if "geometric_design" not in self.datasets:
            return None
        return RedesignResults(
            self.datasets["geometric_design"], self.datasets["geometric_response"]
        )


def load(
    path: Path, preset: str | None, files: Mapping[Output, Path], comparisons: Sequence[Path] = ()
) -> StudyResults:
    """Finds the study of a problem file (with a preset), its datasets, and those of its recordings.

    A recording is called by the folder that its comparison lies in.

    Raises:
        UserError: a file is missing, broken, or made from another problem than this.
    """
    whole = problem.load(path)
    chosen = whole if preset is None else problem.load(path, preset)
    wanted = problem.outputs(chosen)
    if missing := [kind for kind in wanted if kind not in files]:
        what = f"the report of this problem also shows its {missing[0]} dataset"
        option = missing[0].replace("_", "-")
        raise UserError(what, file=path, remedy=f"give it as --{option}")
    read = {name: datasets.read(files[name], cast(Kind, REPORTED[name].kind)) for name in wanted}
    for name, data in read.items():
        posed = chosen
        if name == "geometric_response":
            posed = law_comparison.under(chosen, "geometric")
        elif name == "constants":
            posed = problem.over_measured_constants(chosen, path.parent)
        check_problem(posed, REPORTED[name].name, data, files[name])
    compared = {file.parent.name: _comparison(chosen, file) for file in comparisons}
    return StudyResults(
        name=path.resolve().parent.name,
        preset=preset,
        problem=chosen,
        datasets=read,
        files={f"{kind}.nc": provenance.file_hash(files[kind]) for kind in wanted}
        | {f"recordings/{f.parent.name}/{f.name}": provenance.file_hash(f) for f in comparisons},
        draft=tuple(draft.reasons(chosen, whole)),
        compared=compared,
    )


def load_built(
    path: Path, preset: str | None, results: Path, recordings: Sequence[str] = ()
) -> StudyResults:
    """Finds the study of a problem file, its datasets where the workflow puts them below `results`.

    Raises:
        UserError: as for `load`.
    """
    name = path.resolve().parent.name
    folder = results / (name if preset is None else f"{name}@{preset}")
    wanted = problem.outputs(problem.load(path, preset))
    compared = [folder / f"recordings/{each}/comparison.nc" for each in recordings]
    return load(path, preset, {kind: folder / f"{kind}.nc" for kind in wanted}, compared)


def _comparison(chosen: Problem, path: Path) -> xr.Dataset:
    data = datasets.read(path, "comparison")
    check_problem(chosen, "compare", data, path)
    return data


def check_problem(posed: Problem, stage: str, data: xr.Dataset, path: Path) -> None:
    """Checks that a dataset was made from this problem.

    Raises:
        UserError: it was not.
    """
    wanted = problem.section_hash(posed, stage)
    if (found := data.attrs.get("problem_hash")) != wanted:
        what = "the dataset was made from another problem (or another preset)"
        remedy = "run its stage again with this problem, or give the problem it was made from"
        raise UserError(what, file=path, key="problem_hash", value=found, remedy=remedy)


def display_name(problem: Problem, structure: str) -> str:
    """Tells what figures and pages call a structure."""
    if structure != "altered":
        return structure.capitalize()
    if problem.void is not None:
        return "Voided"
    if problem.inclusion is not None:
        return "Stiffened"
    return "Uncloaked" if problem.static else "Altered"
