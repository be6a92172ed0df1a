"""Which datasets the stages make of a problem, for the rules and the report alike."""

from __future__ import annotations

from typing import Literal

from pipeline.problem.model import Problem

Output = Literal["design", "response", "sweep", "scatter", "verification"]


def outputs(problem: Problem) -> tuple[Output, ...]:
    """The datasets of a problem that its report shows: those of the sections that it has."""
    asked: dict[Output, bool] = {
        "design": True,
        "response": True,
        "sweep": problem.sweep is not None,
        "scatter": problem.robustness is not None,
        "verification": problem.horizon.steps is not None,
    }
    return tuple(name for name, wanted in asked.items() if wanted)
