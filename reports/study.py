"""A study as a report sees it: its problem and the datasets that its stages made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import xarray as xr

from pipeline import datasets, problem, provenance
from pipeline.errors import UserError
from pipeline.problem import Output, Problem, Stage
from reports import draft, scene
from reports.scene import Scene

STAGES: dict[Output, Stage] = {
    "design": "design",
    "response": "simulate",
    "sweep": "sweep",
    "scatter": "scatter",
    "verification": "verify",
}


@dataclass(frozen=True)
class Study:
    """Problem, datasets by kind, where they are from, and why this is but a draft (if it is one).

    `name` is that of the study's folder and of its figure; `files` are hashes of the datasets.
    """

    name: str
    problem: Problem
    datasets: dict[Output, xr.Dataset]
    files: dict[str, str]
    draft: tuple[str, ...] = ()

    @cached_property
    def scene(self) -> Scene:
        """The harmonically driven lattice of the problem.

        Raises:
            UserError: the drive is not harmonic.
        """
        return scene.of(self.problem)

    @property
    def design(self) -> xr.Dataset:
        """The shipped design with the histories of all methods."""
        return self.datasets["design"]

    @property
    def response(self) -> xr.Dataset:
        """What the structures do."""
        return self.datasets["response"]

    @property
    def sweep(self) -> xr.Dataset:
        """The loss over direction and frequency, of a problem that asks for it."""
        return self.datasets["sweep"]

    @property
    def scatter(self) -> xr.Dataset | None:
        """Imperfect copies of the design, if the problem asks for them."""
        return self.datasets.get("scatter")

    @property
    def verification(self) -> xr.Dataset | None:
        """The design under finer load steps and another contact law, of a study on load steps."""
        return self.datasets.get("verification")


def load(path: Path, preset: str | None, files: Mapping[Output, Path]) -> Study:
    """The study of a problem file (with a preset) and its datasets.

    Raises:
        UserError: a file is missing, broken, or made from another problem than this.
    """
    whole = problem.load(path)
    chosen = whole if preset is None else problem.load(path, preset)
    wanted = problem.outputs(chosen)
    if missing := [kind for kind in wanted if kind not in files]:
        raise UserError(
            f"the report of this problem also shows its {missing[0]} dataset",
            file=path,
            remedy=f"give it as --{missing[0]}",
        )
    read = {kind: datasets.read(files[kind], kind) for kind in wanted}
    for kind, data in read.items():
        _check_problem(chosen, kind, data, files[kind])
    return Study(
        name=path.resolve().parent.name,
        problem=chosen,
        datasets=read,
        files={f"{kind}.nc": provenance.file_hash(files[kind]) for kind in wanted},
        draft=tuple(draft.reasons(chosen, whole)),
    )


def _check_problem(chosen: Problem, kind: Output, data: xr.Dataset, path: Path) -> None:
    wanted = problem.section_hash(chosen, STAGES[kind])
    if (found := data.attrs.get("problem_hash")) != wanted:
        raise UserError(
            "the dataset was made from another problem (or another preset)",
            file=path,
            key="problem_hash",
            value=found,
            remedy="run its stage again with this problem, or give the problem it was made from",
        )
