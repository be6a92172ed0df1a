"""States facts that any design and response have: evaluations, margins, gaps, stability."""

import json
from collections.abc import Iterator

import numpy as np
import xarray as xr

from pipeline.posing import design_hash
from pipeline.problem import Problem
from reports.facts import foil, measures
from reports.facts.fact_records import Fact, facts_of, percent, within, worded
from reports.facts.formulas import weighted_force
from reports.study import RigidUnits, angle_budget, display_name, evaluation_count
from sim.core import instruction_set

JUMPED = 2
"""Least flag of a stable state that the path came to by a jump or on a branch."""

_SINCE = "; both counted from the end of those by the angle law"

_told = facts_of(__file__)


def history_facts(problem: Problem, design: xr.Dataset) -> Iterator[Fact]:
    """Yields evaluations, best feasible loss and optimality of every method, and of descents."""
    before, unit = angle_budget(problem), design["best_loss"].attrs["units"]
    if before:
        yield _first_fact(problem, before)
    for method in design["method"].values:
        history, of = design.sel({"method": method}), {"method": method, "name": method.upper()}
        count, best = evaluation_count(history), float(history["best_loss"])
        since = _SINCE if before and method == "sqp" else ""
        when = f"{reached(problem, history)}{since}"
        yield _told("evaluations_{method}", count, reached=when, **of)
        note = shipping(problem, design, str(method)) + weighted_force(problem)
        yield _told("best_{method}", best, unit=unit, note=note, **of)
        at = int(history["best_evaluation"])
        violation = float(history["violation"].isel(evaluation=at))
        yield _told("violation_{method}", violation, **of)
        yield _told("kkt_{method}", float(history["kkt_residual"]), **of)
    yield from _descent_facts(problem, design, unit)


def _descent_facts(problem: Problem, design: xr.Dataset, unit: str) -> Iterator[Fact]:
    """Yields the spread of the losses of several descents, and what all of them cost."""
    descents = json.loads(design.attrs["plan"]).get("descents", [])
    if len(descents) > 1:
        sqp = problem.optimiser.methods.sqp
        each = angle_budget(problem) + (sqp.evaluations if sqp is not None else 0)
        of = {"count": len(descents), "each": each, "all": each * len(descents)}
        losses = [loss for loss in descents if loss is not None]
        words = f"{worded(min(losses), unit, 3)} to {worded(max(losses), unit, 3)}"
        if without := len(descents) - len(losses):
            words += f"; {without} without a design"
        yield _told("descents", max(losses) / min(losses), words, **of)


def reached(problem: Problem, history: xr.Dataset) -> str:
    """Says when the best design of a method was evaluated, and one most of the way to it.

    Losses under loads in ranges are each over the loads of their time: no way leads through them.
    """
    words = f"best feasible after {int(history['best_evaluation'])}"
    if problem.objective.loads is not None:
        return words
    soon = measures.first_within(history["loss"].values, float(history["best_loss"]), 0.9)
    return f"{words}, 90 % of the way after {soon}"


def shipping(problem: Problem, design: xr.Dataset, method: str) -> str:
    """Says whether the best design of a method is shipped, and what its loss is over."""
    words = "shipped" if method == design.attrs.get("shipped_method") else "not shipped"
    if problem.objective.loads is None:
        return words
    return (
        f"{words}; p-mean over the loads designed for then, not the worst of all, which the"
        " certificate tells"
    )


def _first_fact(problem: Problem, evaluations: int) -> Fact:
    """Tells the budget of SQP by the angle law, from whose design it alone goes on."""
    each = ", in each descent" if problem.optimiser.descents > 1 else ""
    other = "; MMA does without" if "mma" in problem.optimiser.methods.chosen else ""
    return _told("evaluations_angle", evaluations, each=each, other=other)


def error_facts(response: xr.Dataset, note: str) -> Iterator[Fact]:
    """Tells what the solver's tolerance leaves of errors."""
    for what in ("loss", "displacement"):
        value = float(response[f"{what}_error"].max())
        yield _told("{what}_error", value, within(value, "1", 2), what=what, note=note)


def bias_fact(initial: RigidUnits) -> Fact:
    """Tells how far the units are turned at rest in the initial design."""
    arm = initial.vertices[0, 0] - initial.site[0]
    return _told("bias", abs(float(np.degrees(np.arctan2(arm[1], arm[0])))))


def design_facts(design: xr.Dataset) -> Iterator[Fact]:
    """Yields margins of the constraints, gaps, overlaps and hash of the design at rest."""
    margins = design["constraint_margin"]
    found = (margins[each].values for each in ("constraint", "constraint_units"))
    for name, unit, margin in zip(*found, margins.values, strict=True):
        length, left = str(unit) == "mm", settled(float(margin))
        value = left if length else float(np.degrees(left))
        yield _told(f"margin_{name}", value, unit="mm" if length else "deg")
    yield _told("gap", float(design["smallest_gap"]))
    yield _told("overlaps", int(design["overlaps"]))
    used, usual = json.loads(design.attrs["packages"])["instructions"], instruction_set.LEVEL
    note = f"of its vertices; the same on every processor with {usual}"
    if used != usual:
        note = f"of its vertices; instructions: {used}; elsewhere it may be another design"
    yield _told("design_hash", np.nan, design_hash(design), note=note)


def path_facts(problem: Problem, design: xr.Dataset, response: xr.Dataset) -> Iterator[Fact]:
    """Yields voids, gaps, overlaps, contacts, stability and shims of every structure on its way."""
    yield from foil.strain_facts(problem, design, response)
    for name in (str(name) for name in response["structure"].values):
        part, words = response.sel(structure=name), display_name(problem, name).lower()
        void, of = float(np.degrees(part["min_void_angle"].min())), {"name": name, "words": words}
        of["when"] = "of all loads" if problem.static else "at any time"
        yield _told("void_angle_{name}", void, **of)
        yield _told("gap_{name}", float(part["min_gap"].min()), **of)
        yield _told("overlaps_{name}", int(part["overlaps"].max()), **of)
        touching, when = part["contact_pairs"], "at any time"
        if problem.static:
            touching, when = touching.isel(time=-1), "at the end of the path"
        yield _told("contact_pairs_{name}", int(touching.max()), **of, note=when)
        yield from stability_facts(name, part, words)


def stability_facts(key: str, part: xr.Dataset, words: str) -> Iterator[Fact]:
    """Yields equilibria of a structure (its name in words), unstable or reached by a jump."""
    flags, of = part["stability"].values, {"key": key, "words": words}
    if (flags >= 0).any():
        yield _told("unstable_{key}", int((flags == 0).sum()), count=flags.size, **of)
        yield _told("jumps_{key}", int((flags >= JUMPED).sum()), **of)
        yield _told("eigenvalue_{key}", float(part["eigenvalue"].min()), **of)


def variant_facts(verification: xr.Dataset | None) -> Iterator[Fact]:
    """Yields losses of the design with finer load steps and under another contact law."""
    if verification is None:
        return
    as_run = verification.isel(check=0).sel(structure="cloaked")
    for name in (str(name) for name in verification["check"].values[1:]):
        found = verification.sel(check=name, structure="cloaked")
        loss, status = float(found["loss"]), str(found["status"].item())
        of = {"name": name, "key": name.replace(" ", "_")}
        of["unit"] = verification["loss"].attrs["units"]
        if status != "ok":
            yield _told("check_{key}", np.nan, "—", note=status, **of)
            continue
        yield _told(
            "check_{key}",
            loss,
            change=percent(loss / float(as_run["loss"]) - 1),
            apart=within(float(found["departure"]), "mm", 2),
            pairs=int(found["contact_pairs"]),
            **of,
        )


def settled(margin: float) -> float:
    """Returns margins within the optimiser's tolerance count as active."""
    return 0.0 if abs(margin) < 1e-5 else margin
