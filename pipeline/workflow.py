"""What the rules ask before anything runs: which studies there are, and what a stage needs of them.

A stage depends on sections of its problem file and on source (pipeline/sources.py). Both enter the
rules as hashes: a rerun follows from what a file says, never from its date. Nothing heavy is
imported here: this is the time one waits for "nothing to be done".
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError
from snakemake.iocontainers import Wildcards

from pipeline.environment import ROOT
from pipeline.errors import UserError
from pipeline.problem import Problem, Stage, load, section_hash

RUN_MARK = "METACLOAK_RUN"  # names the repository in the environment of every job


@dataclass(frozen=True, order=True)
class Study:
    """One study, with one preset of its problem file or with none ("")."""

    name: str
    preset: str = ""

    @classmethod
    def parse(cls, text: str) -> Study:
        """Reads "fig2" or "fig2@edge3"."""
        name, _, preset = text.partition("@")
        return cls(name, preset)

    def __str__(self) -> str:
        return f"{self.name}@{self.preset}" if self.preset else self.name

    @property
    def targets(self) -> tuple[str, ...]:
        """Names under which a command line may ask for the study."""
        return (str(self), f"{self.name}_{self.preset}") if self.preset else (self.name,)

    @property
    def problem(self) -> str:
        """Path of the problem file, from the root of the repository."""
        return f"experiments/{self.name}/problem.yaml"

    @property
    def options(self) -> str:
        """Options by which a stage finds the problem."""
        return f"--problem {self.problem}" + (f" --preset {self.preset}" if self.preset else "")


def studies(root: Path = ROOT) -> list[Study]:
    """Every study below experiments/, each followed by its presets.

    A file that is no YAML counts as a study without presets: the stage that reads it tells why.
    """
    found = []
    for path in sorted(root.glob("experiments/*/problem.yaml")):
        try:
            content = yaml.load(path.read_bytes(), Loader=yaml.CSafeLoader)
        except yaml.YAMLError:
            content = None
        presets = content.get("presets") if isinstance(content, dict) else None
        found.append(Study(path.parent.name))
        found += [Study(path.parent.name, str(preset)) for preset in presets or ()]
    return found


def study_of(wildcards: Wildcards) -> Study:
    """The study that a job works on, from its wildcards `name` and `preset`."""
    return Study.parse(f"{wildcards.name}{wildcards.preset}")


@cache
def problem_of(study: Study) -> Problem:
    """The problem of a study.

    Raises:
        WorkflowError: the problem file is wrong; tells where and what to do.
    """
    try:
        return load(ROOT / study.problem, study.preset or None)
    except UserError as error:
        raise WorkflowError(str(error)) from error


def options(wildcards: Wildcards) -> str:
    """Command-line options by which a stage finds its problem."""
    return study_of(wildcards).options


def designs(wildcards: Wildcards) -> list[str]:
    """The designs to choose from, one for each method that the problem names."""
    study = study_of(wildcards)
    return [
        f"results/{study}/design_{method}.nc"
        for method in problem_of(study).optimiser.methods.chosen
    ]


def section(stage: Stage) -> Callable[[Wildcards], str]:
    """A function from wildcards to the hash of what `stage` depends on in the problem file.

    A job with a wildcard `method` depends on that method's settings and not on the others'.
    """
    return lambda wildcards: section_hash(
        problem_of(study_of(wildcards)), stage, wildcards.get("method")
    )


def prepare_jobs() -> None:
    """Makes the jobs of this workflow run with this Python, and marks them as ours."""
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    os.environ[RUN_MARK] = str(ROOT)
