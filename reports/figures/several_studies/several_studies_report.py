"""Makes the report of several studies: facts and tables by study, one animation of all."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from pipeline.problem import Problem
from pipeline.problem.reading import JointFigure, joint_figure
from pipeline.runtime import UserError
from reports.base import Table, prose
from reports.facts import Fact, fact_records
from reports.figures import loading_path
from reports.figures.loading_path import abscissa_of, measures, structures
from reports.figures.several_studies.figure import heading, several_studies_figure
from reports.page import PageText, Report, publish, study_page
from reports.panels import Animation, case_labels, structure_clip
from reports.study import StudyResults, display_name, study_results

_PROSE = prose(__file__)
_SHARED: dict[str, Callable[[Problem], object]] = {
    "lattice": lambda asked: asked.lattice,
    "material": lambda asked: asked.material,
    "supports": lambda asked: asked.supports,
    "drive": lambda asked: asked.drive,
    "objective.kind": lambda asked: asked.objective.kind,
    "objective.target": lambda asked: asked.objective.target,
}
"""Keys of a problem by which studies on one page are alike, and their values."""


def several_studies_report(
    name: str, asked: JointFigure, studies: Sequence[StudyResults]
) -> Report:
    """Returns the report; `name` is that of the figure."""
    facts = [fact for study in studies for fact in _facts(study)]
    tables = [fact_records.table(facts), *(table for study in studies for table in _tables(study))]
    figure = several_studies_figure(studies)
    by_key = {fact.key: fact for fact in facts}
    headline = []
    for study in studies:
        fact = by_key[f"{study.name}.{measures.measure_of(study.problem).key}_reduction"]
        headline.append(replace(fact, label=f"{heading(study)}: {fact.label.lower()}"))
    text = PageText(
        title=asked.title or ", ".join(map(heading, studies)),
        lead=asked.doc.strip(),
        credit=_credit(studies),
        figure_title="Figure",
        caption=figure.caption,
        headline=headline,
        claimed=name if (preset := studies[0].preset) is None else f"{name}@{preset}",
    )
    by_name = {study.name: study for study in studies}
    return study_page(name, by_name, text, facts, tables, figure.draw, _animation(studies))


def _facts(study: StudyResults) -> list[Fact]:
    """Returns a study's facts, with its name before keys and headings."""
    found = loading_path.facts.loading_path_facts(study)
    return [
        replace(fact, key=f"{study.name}.{fact.key}", group=f"{heading(study)}: {fact.group}")
        for fact in fact_records.quoted(found, study.problem.report.paper)
    ]


def _tables(study: StudyResults) -> list[Table]:
    return [
        replace(
            table,
            name=f"{study.name}_{table.name}",
            text=f"{heading(study)}: {table.text.partition(' (')[0]}",
        )
        for table in loading_path.figure.loading_path_figure(study).tables
    ]


def _credit(studies: Sequence[StudyResults]) -> str:
    """Tells which publication the studies follow, and with which of its values."""
    papers = {p.figure: p.variant for study in studies if (p := study.problem.report.paper)}
    source = "".join(
        _PROSE["after"].format(figure=name)
        + (f", run with its values: {variant}. " if variant else ". ")
        for name, variant in papers.items()
    )
    return source + loading_path.credit(None)


def _animation(studies: Sequence[StudyResults]) -> Animation:
    """Returns every structure along the first study’s path; equal intact ones once."""
    first = studies[0]
    way, times = abscissa_of(first.problem, first.response), first.response["time"]
    clips = []
    for study in studies:
        for name in structures(study.response):
            if name == "intact" and study is not first:
                continue
            motion = study.response.sel(structure=name)["displacement"].interp(time=times)
            label = display_name(study.problem, name)
            label = label if name == "intact" else f"{heading(study)}: {label.lower()}"
            clips.append(structure_clip(label, study, name, motion))
    colours = max(map(loading_path.fields, studies), key=lambda found: found[0].limits[1])
    pad, cases = first.problem.lattice.spacing, case_labels(first.response)
    return Animation(loading_path.axis(way), cases, clips, colours, pad=pad)


def load(figure: Path, asked: JointFigure, preset: str | None, results: Path) -> list[StudyResults]:
    """Reads the studies, in their order.

    Raises:
        UserError: one of them is not like the others, or its datasets are missing.
    """
    found = []
    for name in asked.studies:
        path = figure.parent.parent / name / "problem.yaml"
        found.append(study_results.load_built(path, preset, results))
    for each in found:
        if not each.problem.static:
            what = f"{each.name} is not driven by a ramp"
            remedy = "show studies along a load side by side"
            raise UserError(what, file=figure, key="studies", remedy=remedy)
        refuse_unlike(each, found[0], figure)
    return found


def refuse_unlike(study: StudyResults, first: StudyResults, figure: Path) -> None:
    """Refuses a study whose intact structure, load or measure is not that of the first one.

    Raises:
        UserError: it is not.
    """
    for name, of in _SHARED.items():
        if of(study.problem) != of(first.problem):
            raise UserError(
                f"{study.name} and {first.name} differ in what a page shows of the first alone",
                file=figure,
                key="studies",
                value=name,
                remedy=f"give both the same {name}, or show each on its own page",
            )


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    asked = joint_figure.load_joint_figure(args.figure)
    studies = load(args.figure, asked, args.preset, args.results)
    name = args.figure.resolve().parent.name
    publish(several_studies_report(name, asked, studies), args.out_dir)
