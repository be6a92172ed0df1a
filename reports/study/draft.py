"""Tells why a report shows a draft and not the study itself."""

from typing import Any

from matplotlib.figure import Figure

from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, RampHarmonicDrive, case_count, single_drives
from reports.base import ALTERED


def reasons(problem: Problem, study: Problem) -> list[str]:
    """Lists where `problem`, a preset of `study`, is less than that; empty at full size."""
    reduced = [
        f"{ours:g} {what} instead of {full:g}"
        for (what, ours), full in zip(_sizes(problem).items(), _sizes(study).values(), strict=True)
        if ours < full
    ]
    if problem.solver.accuracy == "draft":
        reduced.append("accuracy of the solver: draft")
    return reduced


def _sizes(problem: Problem) -> dict[str, float]:
    drive, sweep, robustness = problem.drive, problem.sweep, problem.robustness
    directions = drive.directions if isinstance(drive, HarmonicDrive | RampHarmonicDrive) else ()
    first = single_drives(drive)[0]
    moved = {"mm": "displacement", "rad": "rotation"}.get(first.unit, "load")
    sqp = problem.optimiser.methods.sqp
    static = problem.static
    return {
        "units": problem.lattice.n_units,
        "load angles": len(directions),
        f"{first.unit} of driven {moved}": getattr(first, "amplitude", 0.0) if static else 0.0,
        "load steps in the loss": problem.horizon.steps or 0,
        "evaluations of the design": sqp.evaluations if sqp else 0,
        "drive cycles": 0 if static else problem.response.cycles,
        "cases in the sweep": case_count(sweep) if sweep else 0,
        "imperfect copies": robustness.samples if robustness else 0,
    }


def mark(figure: Figure) -> None:
    """Says across the page that this is not the study itself."""
    pale: dict[str, Any] = {"color": ALTERED, "alpha": 0.16, "fontsize": 110, "fontweight": "bold"}
    figure.text(0.5, 0.5, "DRAFT", rotation=45, ha="center", va="center", zorder=100, **pale)
