"""Stage: ships the better design of several methods, a feasible one first, with all histories."""

import argparse
import json
import logging

import xarray as xr

from pipeline import datasets, problem
from pipeline.datasets import provenance
from pipeline.posing import FEASIBLE
from pipeline.runtime import UserError

LOG = logging.getLogger(__name__)


def work(args: argparse.Namespace) -> None:
    """Reads the designs, writes the better one.

    Raises:
        UserError: a design of another problem.
    """
    asked = problem.load(args.problem, args.preset)
    methods = {
        problem.section_hash(asked, "design", name): name for name in asked.optimiser.methods.chosen
    }
    designs = {}
    for path in args.designs:
        design = datasets.read(path, "design_method")
        method = methods.get(design.attrs["problem_hash"])
        if method is None:
            remedy = "remove it and run the same command again"
            raise UserError("the design is of another problem", file=path, remedy=remedy)
        designs[method] = design
    best = min(designs, key=lambda method: _merit(designs[method]))
    if overlaps := int(designs[best]["overlaps"]):
        LOG.warning("%d pairs of units overlap in the shipped design", overlaps)
    if missed := _violation(designs[best]):
        LOG.warning("the shipped design misses a constraint by %.2g (mm, or rad)", missed)
    for method, design in designs.items():
        LOG.info("%s: loss %.5g", method, float(design["best_loss"]))
    LOG.info("shipped: the design by %s", best)
    parents = {path.stem: path for path in args.designs}
    descents = json.loads(designs[best].attrs["plan"]).get("descents", [])
    found: dict[str, object] = {"shipped": best, "descents": descents}
    origin = provenance.of_study(asked, "select", parents=parents, plan=found)
    datasets.write(join(designs, best), args.out, "design", origin)


def _merit(design: xr.Dataset) -> tuple[int, float, float]:
    """Overlapping pairs, found by geometry apart from the constraints; what it misses; the loss."""
    return int(design["overlaps"]), _violation(design), float(design["best_loss"])


def _violation(design: xr.Dataset) -> float:
    """Reads by how much a design misses a constraint, zero if it counts as feasible."""
    missed = float(design["violation"].isel(evaluation=int(design["best_evaluation"])))
    return missed if missed > FEASIBLE else 0.0


def join(designs: dict[str, xr.Dataset], best: str) -> xr.Dataset:
    """Histories of all methods side by side, everything else of the best."""
    history = [
        name
        for name, variable in designs[best].data_vars.items()
        if "evaluation" in variable.dims or name in ("best_evaluation", "best_loss", "kkt_residual")
    ]
    methods = xr.DataArray(list(designs), dims="method", name="method")
    parts = [design[history] for design in designs.values()]
    whole = xr.concat(parts, dim=methods, join="outer", fill_value={"accepted": 0})
    joined = designs[best].drop_vars(["evaluation", *history]).merge(whole, compat="no_conflicts")
    joined.attrs = {"shipped_method": best}
    return joined
