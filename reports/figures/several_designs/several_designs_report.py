"""Makes the report of several designs of one problem: facts, tables, one animation of all."""

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np

from pipeline.posing import loss_units
from reports.base import Table
from reports.facts import fact_records, headed, measures
from reports.figures.loading_path import credit
from reports.figures.several_designs import designs
from reports.figures.several_designs.designs import DesignSeries
from reports.figures.several_designs.facts import design_series_facts
from reports.figures.several_designs.figure import design_series_figure
from reports.page import PageText, Report, publish, study_page
from reports.panels import Animation, size_field, structure_clip, time_axis
from reports.study import DRIVEN

HEADLINE = ("boundary_reduction", "boundary_altered", "boundary_rises")
"""Keys of the facts that stand above all others."""

SHOWN = 45.0
"""Load angle of the animation, degrees."""


def several_designs_report(series: DesignSeries) -> Report:
    """Returns the report."""
    paper, title = series.problem.report.paper, series.problem.title or series.name
    facts = fact_records.quoted(design_series_facts(series), paper)
    by_key = {fact.key: fact for fact in facts}
    figure = design_series_figure(series)
    headline = [by_key[key] for key in HEADLINE]
    lead = series.problem.doc.strip()
    return study_page(
        series.name,
        {design.study.target: design.study for design in series.designs},
        PageText(title, lead, credit(paper), title, figure.caption, headline),
        facts,
        [fact_records.table(facts), _sizes(series), _peaks(series)],
        figure.draw,
        _animation(series),
        (series.target, series.problem),
    )


def _sizes(series: DesignSeries) -> Table:
    columns: dict[str, Sequence[Any]] = {
        series.key: [str(design.word) for design in series.designs],
        "cloak_units": [design.units for design in series.designs],
    }
    for name in ("altered", "cloaked"):
        reached = [float(each.boundary.sel(structure=name)) for each in series.designs]
        columns[f"U_max_{name}"] = reached
        columns[headed(f"J_{name}", loss_units(series.problem))] = [
            design.loss(name) for design in series.designs
        ]
    return Table("sizes.csv", "boundary displacement and loss of every design (panel a)", columns)


def _peaks(series: DesignSeries) -> Table:
    first = series.designs[0]
    columns: dict[str, Any] = {
        name: first.study.response[name].values for name in ("unit", "i", "j")
    }
    columns["U_peak_altered"] = first.peak.sel(structure="altered").values
    for design in series.designs:
        values = design.peak.sel(structure="cloaked").values
        columns[f"U_peak_cloaked_{design.number}"] = values
    return Table("peaks.csv", "peak displacement of every unit (panel b)", columns)


def _animation(series: DesignSeries) -> Animation:
    """Returns the altered structure and every design under one load."""
    first = series.designs[0]
    response, spacing = first.study.response, first.scene.spacing
    case = measures.nearest_case(response, SHOWN)
    shown = [(first, "altered", "Altered")]
    shown += [(each, "cloaked", f"Cloaked, {series.label(each)}") for each in series.designs]
    clips = []
    for design, name, label in shown:
        motion = design.study.response.sel(structure=name)["displacement"].isel(case=[case])
        clips.append(structure_clip(label, design.study, name, motion))
    others = clips[0].structure.support != DRIVEN
    colours = size_field(np.concatenate([each.motion[:, :, others] for each in clips]), spacing)
    angle = measures.case_direction(response, SHOWN)
    axis = time_axis(response["time"].values)
    return Animation(axis, [f"α = {angle:g}°"], clips, [colours], pad=spacing)


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    series = designs.load(args.problem, args.preset, args.results)
    publish(several_designs_report(series), args.out_dir)
