"""The page of several studies: facts and tables by study, and one animation of all structures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

from pipeline.problem import canonical_json
from pipeline.problem.reading import JointFigure
from reports.base import Table, style
from reports.facts import Fact, claims, fact_records
from reports.figures.loading_path import (
    axis,
    course,
    display_name,
    fields,
    marks,
    measures,
    structures,
    tables,
)
from reports.figures.loading_path import facts as path_facts
from reports.figures.several_studies import figure
from reports.page import ReportPage, ReportParts, study_page
from reports.panels import Animation, AnimationClip, payload
from reports.study import StudyResults, from_dataset


def parts(name: str, asked: JointFigure, studies: Sequence[StudyResults]) -> ReportParts:
    """The report of several studies."""
    known = [fact for study in studies for fact in _facts(study)]
    data = [fact_records.table(known), *(table for study in studies for table in _tables(study))]
    return ReportParts(
        name,
        known,
        data,
        lambda: figure.draw_several_studies(studies),
        lambda svg, files: page(name, asked, studies, known, data, svg, files),
    )


def _facts(study: StudyResults) -> list[Fact]:
    """A study's facts, with its name before keys and headings."""
    found = fact_records.quoted(path_facts.loading_path_facts(study), study.problem.report.paper)
    return [
        replace(
            fact, key=f"{study.name}.{fact.key}", group=f"{figure.heading(study)}: {fact.group}"
        )
        for fact in found
    ]


def _tables(study: StudyResults) -> list[Table]:
    return [
        replace(
            table,
            name=f"{study.name}_{table.name}",
            text=f"{figure.heading(study)}: {table.text.partition(' (')[0]}",
        )
        for table in tables.loading_path_tables(study)
    ]


def page(
    name: str,
    asked: JointFigure,
    studies: Sequence[StudyResults],
    known: Sequence[Fact],
    data: Sequence[Table],
    svg: str,
    figure_files: Sequence[str],
) -> ReportPage:
    """The page, of which everything else has been made."""
    by_key = {fact.key: fact for fact in known}
    player = payload(several_studies_animation(studies))
    problems = {study.name: json.loads(canonical_json(study.problem)) for study in studies}
    draft = study_page.drafts_of(studies)
    headline = []
    for study in studies:
        key = f"{study.name}.{measures.measure_of(study.problem).key}_reduction"
        label = f"{figure.heading(study)}: {by_key[key].label.lower()}"
        headline.append(replace(by_key[key], label=label))
    return ReportPage(
        title=asked.title or ", ".join(map(figure.heading, studies)),
        targets=[study.target for study in studies],
        lead=asked.doc.strip(),
        credit=credit(studies),
        figure_title=asked.title,
        caption=caption(studies),
        svg=svg,
        figure_files=figure_files,
        datasets=[f"../../{s.target}/{name}" for s in studies for name in s.files],
        headline=headline,
        facts=known,
        tables=data,
        player=player,
        player_note=study_page.rounding(player),
        provenance=study_page.sources_of({study.name: study for study in studies}),
        problem=json.dumps(problems, indent=1, sort_keys=True, ensure_ascii=False),
        skipped=study_page.skipped_of(studies),
        draft=draft,
        claims=[] if draft else claims.judged(name, known),
    )


def credit(studies: Sequence[StudyResults]) -> str:
    """Which publication the studies follow, and with which of its values."""
    papers = {p.figure: p.variant for study in studies if (p := study.problem.report.paper)}
    source = "".join(
        f"After Figure {name} of Bordiga et al., “Nonlinear mechanical metamaterial cloaks”"
        + (f", run with its values: {variant}. " if variant else ". ")
        for name, variant in papers.items()
    )
    return source + "Every number here is computed from the datasets."


def caption(studies: Sequence[StudyResults]) -> str:
    """Of the figure, as HTML."""
    names = ", ".join(figure.heading(study).lower() for study in studies)
    return (
        f"Structures ({names}) before loading and at full load, true to scale, coloured by "
        "u<sub>y</sub>: intact, altered and cloaked. Below, for each: the loss of distance between "
        "the top and the bottom row, mean over the middle columns, and the mimicking error along "
        f"the load{marks(studies)}."
    )


def several_studies_animation(studies: Sequence[StudyResults]) -> Animation:
    """What plays: every structure along the first study’s path; equal intact ones once."""
    first = studies[0]
    way, times = course(first.problem, first.response), first.response["time"]
    clips = []
    for study in studies:
        for name in structures(study.response):
            if name == "intact" and study is not first:
                continue
            part = study.response.sel(structure=name)
            motion = part["displacement"].interp(time=times)
            colour = style.STRUCTURE_COLOURS[name]
            label = display_name(study.problem, name)
            label = label if name == "intact" else f"{figure.heading(study)}: {label.lower()}"
            shape = from_dataset(part, study.problem.lattice.spacing)
            values = motion.transpose("case", "time", "unit", "dof").values
            clips.append(AnimationClip(label, colour, shape, values))
    colours = max((fields(study) for study in studies), key=lambda found: found[0].limits[1])
    cases = [f"α = {angle:g}°" for angle in first.response["direction"].values]
    return Animation(axis(way), cases, clips, colours, pad=first.problem.lattice.spacing)
