"""The page of structures along a path: its words and its animation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reports.base import style
from reports.facts import JUMPED
from reports.figures.loading_path import measures
from reports.figures.loading_path.abscissa import Abscissa, course, display_name, structures
from reports.figures.loading_path.structure_panels import shade_of
from reports.page import PageText
from reports.panels import (
    Animation,
    AnimationAxis,
    AnimationClip,
    ColourField,
    measured_overlay,
    round_up,
)
from reports.study import StudyResults, from_dataset

_SECOND = "; dashed purple: the cloak optimised again with contact on distance, under that contact"


def loading_path_animation(study: StudyResults) -> Animation:
    """What the player shows: every structure along the path."""
    path, response = course(study.problem, study.response), study.response
    spacing = study.problem.lattice.spacing
    clips: list[AnimationClip] = []
    for name in structures(response):
        part = response.sel(structure=name)
        motion = part["displacement"].transpose("case", "time", "unit", "dof").values
        simulated = AnimationClip(
            display_name(study.problem, name),
            style.STRUCTURE_COLOURS[name],
            from_dataset(part, spacing),
            motion,
        )
        own = [each for each in study.recordings if each.structure == name]
        clips += [*measured_overlay.clips(own, simulated, path.values, spacing), simulated]
    cases = [f"α = {angle:g}°" for angle in response["direction"].values]
    return Animation(axis(path), cases, clips, fields(study), pad=spacing)


def axis(path: Abscissa) -> AnimationAxis:
    """What the slider runs over: once through the path in six seconds."""
    pace = float(path.values[-1] - path.values[0]) / 6.0
    digits = max(0, 3 - int(np.ceil(np.log10(max(path.values[-1], 1e-9)))))
    symbol = path.symbol.strip("$")
    speeds = {"once in 6 s": pace, "3 s": 2 * pace, "12 s": pace / 2}
    return AnimationAxis(symbol, path.unit, path.values, digits, not path.static, speeds)


def fields(study: StudyResults) -> list[ColourField]:
    """What may colour the units; that of the figure first."""
    first = shade_of(study.problem, study.response).field
    motion = study.response["displacement"].values
    across, rise, turn = (round_up(float(np.nanmax(np.abs(motion[..., k])))) for k in range(3))
    turn = round_up(float(np.degrees(np.nanmax(np.abs(motion[..., 2])))))
    degrees = 180.0 / np.pi
    others = [
        ColourField("ux", "u_x", "mm", 1.0, "signed", (-across, across)),
        ColourField("uy", "u_y", "mm", 1.0, "signed", (-rise, rise)),
        ColourField("theta", "θ", "°", degrees, "signed", (-turn, turn)),
    ]
    return [first, *(other for other in others if other.key != first.key)]


def loading_path_text(study: StudyResults) -> PageText:
    """What the page says of itself."""
    paper = study.problem.report.paper
    credit = "Every number here is computed from the datasets."
    if paper is not None:
        variant = f" Run with its values: {paper.variant}." if paper.variant else ""
        credit = (
            f"After Figure {paper.figure} of Bordiga et al., “Nonlinear mechanical metamaterial "
            f"cloaks”.{variant} {credit}"
        )
    key = measures.measure_of(study.problem).key
    return PageText(
        credit=credit,
        figure_title=study.problem.title or study.name,
        caption=caption(study),
        headline=(f"{key}_reduction", f"{key}_altered", f"{key}_cloaked", "loss_reduction"),
    )


def caption(study: StudyResults) -> str:
    """Of the figure, as HTML."""
    problem = study.problem
    parts = [
        "<b>a</b> The structures at rest: dark units are clamped, orange ones driven along the "
        "arrows, purple ones redesigned"
        + (", grey ones stiffened" if problem.inclusion is not None else "")
        + (", green ones of interest." if problem.objective.region != "surroundings" else "."),
        "<b>b</b> Loss against evaluation; rejected evaluations are dots, infeasible ones pale, "
        "the circle is the best feasible design.",
        "<b>c</b> Snapshots at true size, coloured by "
        f"{shade_of(problem, study.response).field.label.replace('u_y', 'u<sub>y</sub>')}.",
        f"<b>d</b> {measures.measure_of(problem).label}{marks([study])}.",
    ]
    letters = iter("efg")
    if course(problem, study.response).static and problem.objective.target != "rest":
        parts.append(
            f"<b>{next(letters)}</b> Loss of distance between the top and the bottom row, mean "
            "over the middle columns."
        )
    parts.append(f"<b>{next(letters)}</b> Force of the drive along its direction.")
    if study.scatter is not None:
        parts.append(
            f"<b>{next(letters)}</b> The measure of panel d at the end of the path over imperfect "
            "cloaks: median and 5 % to 95 %; dashed without, dotted with the perfect cloak."
        )
    return " ".join(parts) + measured_overlay.caption(study.recordings)


def marks(studies: Sequence[StudyResults]) -> str:
    """What else is drawn with the curves of the measure, each after a semicolon."""
    bands = any(study.scatter is not None for study in studies)
    jumps = any((study.response["stability"] == JUMPED).any() for study in studies)
    second = any(study.again is not None and study.again.changed for study in studies)
    return (
        ("; the bands hold 90 % of the imperfect cloaks" if bands else "")
        + ("; crosses mark jumps to another branch" if jumps else "")
        + (_SECOND if second else "")
    )
