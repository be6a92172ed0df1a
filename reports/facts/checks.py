"""States facts that any design and response have: evaluations, margins, gaps, stability."""

import json
from collections.abc import Iterator

import numpy as np
import xarray as xr

from pipeline.posing import design_hash
from pipeline.problem import Problem
from reports.facts import foil, measures
from reports.facts.fact_records import Fact, number, percent, within, worded
from reports.study import RigidUnits, display_name
from sim.core import instruction_set

JUMPED = 2
"""Least flag of a stable state that the path came to by a jump or on a branch."""

_MARGINS = {
    "edge_length": "Edge lengths",
    "block_angle": "Block angles",
    "void_angle": "Void angles",
    "convexity": "Convexity",
    "gap": "Gaps",
    "slot_angle": "Angles of slots",
    "slot_wall": "Walls at slots",
    "slot_gap": "Walls between slots",
    "slot_turn": "Angles of slots against ligaments",
}


def history_facts(problem: Problem, design: xr.Dataset) -> Iterator[Fact]:
    """Yields evaluations, best feasible loss and optimality of every method, and of descents."""
    first = problem.optimiser.angle
    if first is not None and problem.contact.law == "geometric":
        note = "by the angle law of contact; those below start from there, with contact on distance"
        yield number("evaluations_angle", "First, SQP: at most", first.evaluations, note=note)
    for method in design["method"].values:
        history = design.sel({"method": method})
        loss = history["loss"].values
        count, best = int(np.isfinite(loss).sum()), float(history["best_loss"])
        name, at = str(method).upper(), int(history["best_evaluation"])
        unit = design["best_loss"].attrs["units"]
        soon = measures.first_within(loss[:count], best, 0.9)
        note = f"best feasible after {at}, 90 % of the way after {soon}"
        yield number(f"evaluations_{method}", f"Evaluations, {name}", count, note=note)
        note = "shipped" if method == design.attrs.get("shipped_method") else "not shipped"
        label = f"Best feasible loss, {name}"
        yield number(f"best_{method}", label, best, unit, digits=3, note=note)
        violation = float(history["violation"].isel(evaluation=at))
        label = f"Largest constraint violation of it, {name}"
        yield number(f"violation_{method}", label, violation, digits=2, note="scaled; 0: feasible")
        residual = float(history["kkt_residual"])
        yield number(f"kkt_{method}", f"KKT residual, {name}", residual, digits=2)
    losses = json.loads(design.attrs["plan"]).get("descents", [])
    if len(losses) > 1:
        unit, label = design["best_loss"].attrs["units"], f"Losses of {len(losses)} descents"
        words = f"{worded(min(losses), unit, 3)} to {worded(max(losses), unit, 3)}"
        note = "with other seeds and starts; the best is shipped"
        yield Fact("descents", label, max(losses) / min(losses), "1", words, note=note)


def error_facts(response: xr.Dataset, note: str) -> Iterator[Fact]:
    """Tells what the solver's tolerance leaves of errors."""
    for key, label in (("loss_error", "loss"), ("displacement_error", "displacement")):
        value = float(response[key].max())
        yield Fact(
            key, f"Estimated error of the {label}", value, "1", within(value, "1", 2), note=note
        )


def bias_fact(initial: RigidUnits) -> Fact:
    """Tells how far the units are turned at rest in the initial design."""
    arm = initial.vertices[0, 0] - initial.site[0]
    bias = abs(float(np.degrees(np.arctan2(arm[1], arm[0]))))
    note = "measured on the initial design"
    return number("bias", "Angle bias θ₀", bias, "deg", note=note)


def design_facts(design: xr.Dataset) -> Iterator[Fact]:
    """Yields margins of the constraints, gaps, overlaps and hash of the design at rest."""
    margins = design["constraint_margin"]
    found = (margins[each].values for each in ("constraint", "constraint_units"))
    for name, unit, margin in zip(*found, margins.values, strict=True):
        label = f"{_MARGINS[str(name)]}: margin to the bound"
        length, left = str(unit) == "mm", settled(float(margin))
        value = left if length else float(np.degrees(left))
        note = "smallest of the design at rest; 0 is active, negative violated"
        yield number(f"margin_{name}", label, value, "mm" if length else "deg", digits=3, note=note)
    rest, gap = "at rest, by geometry", float(design["smallest_gap"])
    yield number("gap", "Smallest gap between units", gap, "mm", digits=3, note=rest)
    yield number("overlaps", "Overlapping pairs of units", int(design["overlaps"]), note=rest)
    used = json.loads(design.attrs["packages"])["instructions"]
    note = f"of its vertices; the same on every processor with {instruction_set.LEVEL}"
    if used != instruction_set.LEVEL:
        note = f"of its vertices; instructions: {used}; elsewhere it may be another design"
    yield Fact("design_hash", "Hash of the design", np.nan, "1", design_hash(design), note=note)


def path_facts(problem: Problem, response: xr.Dataset) -> Iterator[Fact]:
    """Yields voids, gaps, overlaps, contacts, stability and shims of every structure on its way."""
    yield from foil.strain_facts(problem, response)
    for name in (str(name) for name in response["structure"].values):
        part, words = response.sel(structure=name), display_name(problem, name).lower()
        void, gap = float(np.degrees(part["min_void_angle"].min())), float(part["min_gap"].min())
        label = f"Smallest void angle, {words}"
        yield number(f"void_angle_{name}", label, void, "deg", digits=3, note="of all loads")
        note = "of all loads, by geometry"
        yield number(f"gap_{name}", f"Smallest gap, {words}", gap, "mm", digits=3, note=note)
        crossed = int(part["overlaps"].max())
        yield number(f"overlaps_{name}", f"Overlapping pairs, {words}, most", crossed, note=note)
        touching, when = part["contact_pairs"], "at any time"
        if problem.static:
            touching, when = touching.isel(time=-1), "at the end of the path"
        label = f"Pairs in contact, {words}"
        yield number(f"contact_pairs_{name}", label, int(touching.max()), note=when)
        yield from stability_facts(name, part, words)


def stability_facts(key: str, part: xr.Dataset, words: str) -> Iterator[Fact]:
    """Yields equilibria of a structure (its name in words), unstable or reached by a jump."""
    flags = part["stability"].values
    if (flags >= 0).any():
        label, count = f"Unstable equilibria, {words}", int((flags == 0).sum())
        note = f"of {flags.size}; where the tangent is not positive definite"
        yield number(f"unstable_{key}", label, count, note=note)
        label, count = f"Jumps to another branch, {words}", int((flags >= JUMPED).sum())
        note = "loads reached only past a limit point or a branching"
        yield number(f"jumps_{key}", label, count, note=note)
        least = float(part["eigenvalue"].min())
        label = f"Smallest eigenvalue of the tangent, {words}"
        note = "of all loads, at fixed supports and drive; the path ends where it vanishes"
        yield number(f"eigenvalue_{key}", label, least, "N/mm", digits=3, note=note)


def variant_facts(verification: xr.Dataset | None) -> Iterator[Fact]:
    """Yields losses of the design with finer load steps and under another contact law."""
    if verification is None:
        return
    unit = verification["loss"].attrs["units"]
    as_run = verification.isel(check=0).sel(structure="cloaked")
    for name in (str(name) for name in verification["check"].values[1:]):
        found = verification.sel(check=name, structure="cloaked")
        key, loss = name.replace(" ", "_"), float(found["loss"])
        if str(found["status"].item()) != "ok":
            label = f"Loss, cloaked, {name}"
            yield Fact(f"check_{key}", label, np.nan, unit, "—", note=str(found["status"].item()))
            continue
        note = (
            f"{percent(loss / float(as_run['loss']) - 1)} against the run; units at equal loads "
            f"{within(float(found['departure']), 'mm', 2)} apart; "
            f"{int(found['contact_pairs'])} pairs in contact at full load"
        )
        yield number(f"check_{key}", f"Loss, cloaked, {name}", loss, unit, digits=3, note=note)


def settled(margin: float) -> float:
    """Returns margins within the optimiser's tolerance count as active."""
    return 0.0 if abs(margin) < 1e-5 else margin
