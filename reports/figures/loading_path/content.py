"""Tells what the page of structures along a path says and plays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from pipeline.problem.sections import Paper
from reports.facts import Fact
from reports.figures.loading_path import measures
from reports.figures.loading_path.abscissa import Abscissa, abscissa_of, display_name, structures
from reports.figures.loading_path.structure_panels import shade_of
from reports.page import PageText, study_text
from reports.panels import (
    Animation,
    AnimationAxis,
    AnimationClip,
    ColourField,
    case_labels,
    signed_field,
    structure_clip,
    with_recordings,
)
from reports.study import StudyResults

_KEYS: tuple[Literal["ux", "uy", "theta"], ...] = ("ux", "uy", "theta")


def loading_path_animation(study: StudyResults) -> Animation:
    """Returns every structure along the path, with its recordings."""
    path, response = abscissa_of(study.problem, study.response), study.response
    clips: list[AnimationClip] = []
    for name in structures(response):
        clip = structure_clip(display_name(study.problem, name), study, name)
        clips += with_recordings(clip, study, name, path.values)
    pad = study.problem.lattice.spacing
    return Animation(axis(path), case_labels(response), clips, fields(study), pad=pad)


def axis(path: Abscissa) -> AnimationAxis:
    """Returns what the slider runs over: once through the path in six seconds."""
    pace = float(path.values[-1] - path.values[0]) / 6.0
    digits = max(0, 3 - int(np.ceil(np.log10(max(path.values[-1], 1e-9)))))
    symbol = path.symbol.strip("$")
    speeds = {"once in 6 s": pace, "3 s": 2 * pace, "12 s": pace / 2}
    return AnimationAxis(symbol, path.unit, path.values, digits, not path.static, speeds)


def fields(study: StudyResults) -> list[ColourField]:
    """Lists what may colour the units; that of the figure first."""
    first = shade_of(study.problem, study.response).field
    motion = study.response["displacement"].values
    return [first, *(signed_field(key, motion) for key in _KEYS if key != first.key)]


def loading_path_text(study: StudyResults, caption: str, facts: Sequence[Fact]) -> PageText:
    """Returns what the page says of itself."""
    key = measures.measure_of(study.problem).key
    headline = (f"{key}_reduction", f"{key}_altered", f"{key}_cloaked", "loss_reduction")
    return study_text(
        study, caption, facts, credit=credit(study.problem.report.paper), headline=headline
    )


def credit(paper: Paper | None) -> str:
    """Tells which figure of the paper a study follows, and with which of its values."""
    source = ""
    if paper is not None:
        variant = f" Run with its values: {paper.variant}." if paper.variant else ""
        source = (
            f"After Figure {paper.figure} of Bordiga et al., “Nonlinear mechanical metamaterial "
            f"cloaks”.{variant} "
        )
    return f"{source}Every number here is computed from the datasets."
