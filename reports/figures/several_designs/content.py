"""The page of several designs of one problem, and its tables."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from pipeline.problem import canonical_json
from reports.base import Table, style
from reports.facts import Fact, claims, fact_records, measures
from reports.figures.several_designs import facts as family_facts
from reports.figures.several_designs import figure
from reports.figures.several_designs.designs import DesignSeries
from reports.page import ReportPage, ReportParts, study_page
from reports.panels import Animation, AnimationAxis, AnimationClip, ColourField, payload, round_up
from reports.study import DRIVEN, from_dataset

HEADLINE = ("boundary_reduction", "boundary_altered", "boundary_rises")
"""Keys of the facts that stand above all others."""

SHOWN = 45.0
"""Load angle of the animation, degrees."""


def parts(family: DesignSeries) -> ReportParts:
    """The report."""
    known = fact_records.quoted(
        family_facts.design_series_facts(family), family.problem.report.paper
    )
    data = [fact_records.table(known), sizes(family), peaks(family)]
    return ReportParts(
        family.name,
        known,
        data,
        lambda: figure.draw_design_series(family),
        lambda svg, files: page(family, known, data, svg, files),
    )


def sizes(family: DesignSeries) -> Table:
    """One row a design."""
    of_all = family.designs
    columns: dict[str, Sequence[Any]] = {
        family.key: [str(design.word) for design in of_all],
        "cloak_units": [design.units for design in of_all],
    }
    for name in ("altered", "cloaked"):
        columns[f"U_max_{name}"] = [float(d.boundary.sel(structure=name)) for d in of_all]
        columns[f"J_{name}"] = [design.loss(name) for design in of_all]
    return Table("sizes.csv", "boundary displacement and loss of every design (panel a)", columns)


def peaks(family: DesignSeries) -> Table:
    """One row a unit."""
    first = family.designs[0]
    columns: dict[str, Any] = {
        name: first.study.response[name].values for name in ("unit", "i", "j")
    }
    columns["U_peak_altered"] = first.peak.sel(structure="altered").values
    for design in family.designs:
        values = design.peak.sel(structure="cloaked").values
        columns[f"U_peak_cloaked_{design.number}"] = values
    return Table("peaks.csv", "peak displacement of every unit (panel b)", columns)


def page(
    family: DesignSeries,
    known: Sequence[Fact],
    data: Sequence[Table],
    svg: str,
    figure_files: Sequence[str],
) -> ReportPage:
    """The page, of which everything else has been made."""
    by_key = {fact.key: fact for fact in known}
    studies = [design.study for design in family.designs]
    player = payload(design_series_animation(family))
    draft = study_page.drafts_of(studies)
    return ReportPage(
        title=family.problem.title,
        targets=[family.target],
        lead=family.problem.doc.strip(),
        credit=credit(family),
        figure_title=family.problem.title,
        caption=caption(family),
        svg=svg,
        figure_files=figure_files,
        datasets=[f"../../{study.target}/{name}" for study in studies for name in study.files],
        headline=[by_key[key] for key in HEADLINE],
        facts=known,
        tables=data,
        player=player,
        player_note=study_page.rounding(player),
        provenance=study_page.sources_of({study.target: study for study in studies}),
        problem=json.dumps(
            json.loads(canonical_json(family.problem)), indent=1, sort_keys=True, ensure_ascii=False
        ),
        skipped=study_page.skipped_of(studies),
        draft=draft,
        claims=[] if draft else claims.judged(family.name, known),
    )


def credit(family: DesignSeries) -> str:
    """Which publication the study follows."""
    paper = family.problem.report.paper
    title = "of Bordiga et al., “Nonlinear mechanical metamaterial cloaks”"
    source = f"After Figure {paper.figure} {title}. " if paper else ""
    return source + "Every number here is computed from the datasets."


def caption(family: DesignSeries) -> str:
    """Of the figure, as HTML."""
    over = "the size of the cloak" if family.key == "cloak.disc.radius" else family.key
    return (
        f"<b>a</b> Largest |U| of a unit of the outer rows and columns against {over}: altered "
        "(dashed) and cloaked structures, mean over the load angles of the greatest in time. "
        "<b>b</b> Altered and cloaked structures, coloured by the largest |U| of each unit in "
        "time, mean over the load angles; |U| counts displacements in spacings, rotations in "
        "radians. "
        "Dashed circles bound the cloaks, hatched pads clamp the corners."
    )


def design_series_animation(family: DesignSeries) -> Animation:
    """What plays: the altered structure and every design under one load."""
    first = family.designs[0]
    case = measures.nearest_case(first.study.response, SHOWN)
    shown = [(first, "altered", "Altered")]
    shown += [(each, "cloaked", f"Cloaked, {family.label(each)}") for each in family.designs]
    clips = []
    for design, name, label in shown:
        part = design.study.response.sel(structure=name)
        motion = part["displacement"].isel(case=[case]).transpose("case", "time", "unit", "dof")
        structure = from_dataset(part, design.scene.spacing)
        clips.append(AnimationClip(label, style.STRUCTURE_COLOURS[name], structure, motion.values))
    times = first.study.response["time"].values
    axis = AnimationAxis("t", "s", times, 3, True, {"¼ of real time": 0.25, "⅛": 0.125, "½": 0.5})
    scene = first.scene
    angle = measures.case_direction(first.study.response, SHOWN)
    others = clips[0].structure.support != DRIVEN
    largest = max(
        float(np.nanmax(np.linalg.norm(clip.motion[:, :, others] / scene.scale, axis=-1)))
        for clip in clips
    )
    scale = (scene.spacing, scene.spacing, 1.0)
    field = ColourField("norm", "|U|", "", 1.0, "magnitude", (0.0, round_up(largest)), scale)
    return Animation(axis, [f"α = {angle:g}°"], clips, [field], pad=scene.spacing)
