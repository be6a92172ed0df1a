"""Tells what the page of Figure 2 says and plays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from reports.base import style
from reports.facts import Fact, measures
from reports.figures.shielding.facts import MONITORED
from reports.page import PageText, study_text
from reports.panels import (
    Animation,
    AnimationClip,
    DashedDisc,
    case_labels,
    signed_field,
    size_field,
    structure_clip,
    time_axis,
    with_recordings,
)
from reports.study import DRIVEN, StudyResults, middle_of_top_edge


def shielding_text(study: StudyResults, caption: str, facts: Sequence[Fact]) -> PageText:
    """Returns what the page says of itself."""
    return study_text(
        study,
        caption,
        facts,
        credit=(
            "After Figure 2 of Bordiga et al., “Nonlinear mechanical metamaterial cloaks”; every "
            "number here is computed from the datasets."
        ),
        figure_title="Shielding dynamic excitations",
        headline=("mean_reduction", "loss_end", "peak_to_peak_reduction", "map_max"),
        note="The dot marks the unit of panel d.",
    )


def shielding_animation(study: StudyResults) -> Animation:
    """Returns altered and cloaked structures under every load, with their recordings."""
    scene, response = study.scene, study.response
    clips: list[AnimationClip] = []
    times = response["time"].values
    for name in ("altered", "cloaked"):
        clip = structure_clip(name.capitalize(), study, name)
        clip = replace(clip, marker=middle_of_top_edge(clip.structure))
        clips += with_recordings(clip, study, name, times)
    others = clips[0].structure.support != DRIVEN
    motion = np.concatenate([clip.motion[:, :, others] for clip in clips])
    colours = [
        size_field(motion, scene.spacing),
        signed_field("uy", motion),
        signed_field("theta", motion),
    ]
    discs = [DashedDisc(*scene.middle, radius, style.CLOAKED) for radius in scene.radii]
    start = measures.nearest_case(response, MONITORED)
    return Animation(
        *(time_axis(times, real=True), case_labels(response), clips, colours, discs),
        start=start,
        pad=scene.spacing,
    )
