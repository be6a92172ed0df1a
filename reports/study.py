"""A study as a report sees it: its problem and the datasets that its stages made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from pipeline import datasets, problem, provenance
from pipeline.errors import UserError
from pipeline.problem import Problem, Stage
from reports import scene
from reports.scene import Scene

_STAGES: dict[datasets.Kind, Stage] = {
    "design": "design",
    "response": "simulate",
    "sweep": "sweep",
}


@dataclass(frozen=True)
class Study:
    """Problem, datasets, where they are from, and why this is but a draft (if it is one).

    `name` is that of the study's folder and of its figure; `files` are hashes of the datasets.
    """

    name: str
    problem: Problem
    scene: Scene
    design: xr.Dataset
    response: xr.Dataset
    sweep: xr.Dataset
    files: dict[str, str]
    draft: tuple[str, ...] = ()

    @property
    def datasets(self) -> dict[str, xr.Dataset]:
        """The datasets by kind."""
        return {"design": self.design, "response": self.response, "sweep": self.sweep}


def load(path: Path, preset: str | None, design: Path, response: Path, sweep: Path) -> Study:
    """The study of a problem file (with a preset) and its three datasets.

    Raises:
        UserError: a file is missing, broken, or made from another problem than this.
    """
    whole = problem.load(path)
    chosen = whole if preset is None else problem.load(path, preset)
    paths: dict[datasets.Kind, Path] = {"design": design, "response": response, "sweep": sweep}
    read = {kind: datasets.read(paths[kind], kind) for kind in paths}
    for kind, data in read.items():
        _check_problem(chosen, kind, data, paths[kind])
    return Study(
        name=path.resolve().parent.name,
        problem=chosen,
        scene=scene.of(chosen),
        design=read["design"],
        response=read["response"],
        sweep=read["sweep"],
        files={f"{kind}.nc": provenance.file_hash(paths[kind]) for kind in paths},
        draft=tuple(scene.draft_reasons(chosen, whole)),
    )


def _check_problem(chosen: Problem, kind: datasets.Kind, data: xr.Dataset, path: Path) -> None:
    wanted = problem.section_hash(chosen, _STAGES[kind])
    if (found := data.attrs.get("problem_hash")) != wanted:
        raise UserError(
            "the dataset was made from another problem (or another preset)",
            file=path,
            key="problem_hash",
            value=found,
            remedy="run its stage again with this problem, or give the problem it was made from",
        )
