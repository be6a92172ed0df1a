"""Lists the datasets that stages make of a problem, for the rules and the report alike."""

from __future__ import annotations

from typing import Literal

from pipeline.problem.model import Problem

Output = Literal[
    "design",
    "response",
    "sweep",
    "scatter",
    "verification",
    "geometric_design",
    "geometric_response",
]


def outputs(problem: Problem) -> tuple[Output, ...]:
    """The datasets of a problem that its report shows: those of the sections that it has."""
    by_angle = problem.static and problem.contact.law == "angle"
    wave = not problem.static and problem.objective.target == "intact"
    asked: dict[Output, bool] = {
        "design": True,
        "response": True,
        "sweep": problem.sweep is not None,
        "scatter": problem.robustness is not None,
        "verification": problem.horizon.steps is not None or wave,
        "geometric_design": by_angle,
        "geometric_response": by_angle,
    }
    return tuple(name for name, wanted in asked.items() if wanted)
