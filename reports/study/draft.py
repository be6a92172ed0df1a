"""Tells why a report shows a draft and not the study itself."""

from typing import Any

from matplotlib.figure import Figure

from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, RampHarmonicDrive, case_count, single_drives
from reports.base import ALTERED


def reasons(problem: Problem, study: Problem) -> list[str]:
    """Lists where `problem`, a preset of `study`, is less than that; empty at full size.

    Only what both have is compared: a force is no less than a displacement, and a preset that has
    another method of optimisation alone, or no sweep, is whole without.
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
    return {
        "units": problem.lattice.n_units,
        **_load_sizes(problem),
        **_budgets(problem),
        **({} if sweep is None else {"cases in the sweep": case_count(sweep)}),
        **({} if robustness is None else {"imperfect copies": robustness.samples}),
    }


def _budgets(problem: Problem) -> dict[str, float]:
    """Lists the evaluations of every method; a design that starts from another needs fewer."""
    optimiser = problem.optimiser
    chosen = optimiser.methods.chosen if optimiser.start == "initial" else {}
    return {f"evaluations by {name.upper()}": each.evaluations for name, each in chosen.items()}


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
