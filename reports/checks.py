"""Facts that any design and any response have: evaluations, margins, gaps, overlaps, stability."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr

from reports import measures
from reports.facts import Fact, number

_MARGINS = {
    "edge_length": "Edge lengths",
    "block_angle": "Block angles",
    "void_angle": "Void angles",
    "convexity": "Convexity",
    "gap": "Gaps",
}


def history_facts(design: xr.Dataset) -> Iterator[Fact]:
    """Evaluations, best feasible loss and optimality of every method."""
    for method in design["method"].values:
        history = design.sel({"method": method})
        loss = history["loss"].values
        count, best = int(np.isfinite(loss).sum()), float(history["best_loss"])
        name, at = str(method).upper(), int(history["best_evaluation"])
        soon = measures.first_within(loss[:count], best, 0.9)
        note = f"best feasible after {at}, 90 % of the way after {soon}"
        yield number(f"evaluations_{method}", f"Evaluations, {name}", count, note=note)
        note = "shipped" if method == design.attrs.get("shipped_method") else "not shipped"
        yield number(f"best_{method}", f"Best feasible loss, {name}", best, digits=3, note=note)
        violation = float(history["violation"].isel(evaluation=at))
        label = f"Largest constraint violation of it, {name}"
        yield number(f"violation_{method}", label, violation, digits=2, note="scaled; 0: feasible")
        residual = float(history["kkt_residual"])
        yield number(f"kkt_{method}", f"KKT residual, {name}", residual, digits=2)


def design_facts(design: xr.Dataset) -> Iterator[Fact]:
    """Margins of the constraints, gaps and overlaps of the design at rest."""
    margins = zip(design["constraint"].values, design["constraint_margin"].values, strict=True)
    for name, margin in margins:
        label = f"{_MARGINS.get(str(name), str(name))}: margin to the bound"
        length = str(name) in {"edge_length", "gap"}
        value = float(margin) if length else float(np.degrees(margin))
        note = "smallest of the design at rest; 0 is active, negative violated"
        yield number(
            f"margin_{name}", label, settled(value), "mm" if length else "deg", digits=3, note=note
        )
    rest, gap = "at rest, by geometry", float(design["smallest_gap"])
    yield number("gap", "Smallest gap between units", gap, "mm", digits=3, note=rest)
    yield number("overlaps", "Overlapping pairs of units", int(design["overlaps"]), note=rest)


def path_facts(response: xr.Dataset) -> Iterator[Fact]:
    """Voids, gaps and overlaps of every structure on its way."""
    for name in response["structure"].values:
        part = response.sel(structure=name)
        void = float(np.degrees(part["min_void_angle"].min()))
        label = f"Smallest void angle, {name}"
        yield number(f"void_angle_{name}", label, void, "deg", digits=3, note="of all loads")
        gap, note = float(part["min_gap"].min()), "of all loads, by geometry"
        yield number(f"gap_{name}", f"Smallest gap, {name}", gap, "mm", digits=3, note=note)
        crossed = int(part["overlaps"].max())
        yield number(f"overlaps_{name}", f"Overlapping pairs, {name}, most", crossed, note=note)


def settled(margin: float) -> float:
    """Margins within the optimiser's tolerance count as active."""
    return 0.0 if abs(margin) < 1e-5 else margin
