"""Makes the report of a sweep over any parameters: figure, numbers, tables, one page."""

import argparse

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from pipeline import datasets, problem
from pipeline.problem.sections import names_directions
from pipeline.runtime import UserError
from reports.base import Table, prose
from reports.facts import Fact, grouped, number, share, table
from reports.page import FigureText, PageTable, figure_page, publish, titled
from reports.products.sweep import cases, figure
from reports.study import draft, study_results

_RANKED = 30  # cases, below which a rank correlation says nothing
_PROSE = prose(__file__)


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for.

    Raises:
        UserError: the problem asks for no sweep, or the dataset is of another problem.
    """
    whole = problem.load(args.problem)
    asked = problem.load(args.problem, args.preset) if args.preset else whole
    sweep = asked.sweep
    if sweep is None:
        remedy = "add sweep.grid, sweep.list or sweep.random"
        what = "the problem asks for no sweep"
        raise UserError(what, file=args.problem, key="sweep", remedy=remedy)
    data = datasets.read(args.sweep, "sweep")
    study_results.check_problem(asked, "sweep", data, args.sweep)
    caption = _PROSE["maps" if cases.mapped(sweep) else "points"]
    why = draft.reasons(asked, whole)

    def drawn() -> Figure:
        made = figure.draw_sweep(data, sweep)
        if why:
            draft.mark(made)
        return made

    made = figure_page(
        "sweep",
        FigureText(titled(asked, args.problem), "sweep", _PROSE["lead"], caption),
        drawn,
        tables(data),
        data,
        shown=shown(data),
        draft=why,
        parents=["design"],
    )
    publish(made, args.out_dir)


def facts(data: xr.Dataset) -> list[Fact]:
    """Returns the numbers of a sweep."""
    good = data.isel(case=np.flatnonzero(cases.good(data)))
    found = grouped("Cases", _counts(data, good))
    if good.sizes["case"]:
        found += grouped("Losses", _losses(good))
        found += grouped("Contact", [_void(good)])
    if good.sizes["case"] >= _RANKED:
        found += grouped("Rank correlation with the loss of the cloaked structure", _ranks(good))
    return found


def shown(data: xr.Dataset) -> PageTable:
    """Returns the numbers, and how many cases failed for which reason, as the page's table."""
    rows = [(fact.group, fact.label, fact.ours, fact.note) for fact in facts(data)]
    failed = [("Failed cases", why, str(count), "") for why, count in cases.failures(data)]
    return PageTable(("of", "quantity", "here", "how it is taken"), [*rows, *failed])


def tables(data: xr.Dataset) -> list[Table]:
    """Returns the numbers, and every case with what came of it."""
    units = data["loss"].attrs["units"]
    settings = {
        str(key): data["setting"].sel(parameter=key).values for key in data.parameter.values
    }
    columns = {
        "case": data["case"].values,
        **settings,
        f"loss ({units})": data["loss"].values,
        f"loss_altered ({units})": data["loss_altered"].values,
        "min_void_angle (rad)": data["min_void_angle"].values,
        "status": data["status"].values,
    }
    every = Table("cases.csv", "every case: what it sets and what came of it", columns)
    return [every, table(facts(data))]


def _counts(data: xr.Dataset, good: xr.Dataset) -> list[Fact]:
    total, left = data.sizes["case"], good.sizes["case"]
    alone = names_directions(dict.fromkeys(map(str, data["parameter"].values), 0.0))
    mean = "" if alone else "each the weighted mean of its load cases"
    return [
        number("cases", "Cases", total, digits=9, note=mean),
        number("failed", "Failed cases", total - left, digits=9, note="below with their reasons"),
    ]


def _losses(good: xr.Dataset) -> list[Fact]:
    ratio = cases.ratio(good)
    units = good["loss"].attrs["units"]
    found = [
        share("improved", "Cases in which the cloak lowers the loss", float((ratio < 1).mean())),
        share("median_ratio", "Loss, cloaked over altered: median", float(np.nanmedian(ratio))),
        share("worst_ratio", "Loss, cloaked over altered: largest", float(np.nanmax(ratio))),
    ]
    for key, name, structure in (
        ("loss", "Loss of the cloaked structure", "loss"),
        ("loss_altered", "Loss of the altered structure", "loss_altered"),
    ):
        low, middle, high = np.percentile(good[structure].values, (5, 50, 95))
        note = f"5 % of the cases lie below {low:.4g}, 5 % above {high:.4g}"
        found.append(number(key, f"{name}: median", float(middle), units, note=note))
    return found


def _void(good: xr.Dataset) -> Fact:
    angle = float(np.degrees(good["min_void_angle"].min()))
    return number("min_void_angle", "Smallest void angle, cloaked structure", angle, "deg")


def _ranks(good: xr.Dataset) -> list[Fact]:
    """Returns Spearman's, of every parameter that has numbers for values."""
    from scipy.stats import spearmanr

    numeric = [axis for axis in cases.axes(good) if not axis.words and len(axis.distinct) > 1]
    return [
        number(
            f"rank_{place}",
            axis.label,
            float(spearmanr(axis.places, good["loss"].values).statistic),
            digits=2,
            note="1: the loss rises with it in every case; 0: no order",
        )
        for place, axis in enumerate(numeric)
    ]
