"""Tells why a report shows a draft and not the study itself."""

from typing import Any

from matplotlib.figure import Figure

from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, RampHarmonicDrive, case_count, single_drives
from reports.base import ALTERED


def reasons(problem: Problem, study: Problem) -> list[str]:
    """Lists where `problem`, a preset of `study`, is less than that; empty at full size.

    Only what both have is compared: a force is no less than a displacement.
    """
    full = _sizes(study)
    reduced = [
        f"{ours:g} {what} instead of {full[what]:g}"
        for what, ours in _sizes(problem).items()
        if ours < full.get(what, ours)
    ]
    if problem.solver.accuracy == "draft" and not problem.static:
        reduced.append("accuracy of the solver: draft")
    return reduced


def _sizes(problem: Problem) -> dict[str, float]:
    sweep, robustness = problem.sweep, problem.robustness
    sqp = problem.optimiser.methods.sqp
    return {
        "units": problem.lattice.n_units,
        **_load_sizes(problem),
        "evaluations of the design": sqp.evaluations if sqp else 0,
        "cases in the sweep": case_count(sweep) if sweep else 0,
        "imperfect copies": robustness.samples if robustness else 0,
    }


def _load_sizes(problem: Problem) -> dict[str, float]:
    """Measures the load by what its kind has: static ones an amplitude, others cycles."""
    drive = problem.drive
    if not problem.static:
        turned = isinstance(drive, HarmonicDrive | RampHarmonicDrive)
        angles = {"load angles": float(len(drive.case_weights))} if turned else {}
        return angles | {"drive cycles": problem.response.cycles}
    first = single_drives(drive)[0]
    moved = {"mm": "displacement", "rad": "rotation"}.get(first.unit, "load")
    amplitude = getattr(first, "amplitude", None)
    driven = {} if amplitude is None else {f"{first.unit} of driven {moved}": abs(amplitude)}
    return driven | {"load steps in the loss": problem.horizon.steps or 0}


def mark(figure: Figure) -> None:
    """Says across the page that this is not the study itself."""
    pale: dict[str, Any] = {"color": ALTERED, "alpha": 0.16, "fontsize": 110, "fontweight": "bold"}
    figure.text(0.5, 0.5, "DRAFT", rotation=45, ha="center", va="center", zorder=100, **pale)
