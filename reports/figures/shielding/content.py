"""The page of Figure 2: its words and its animation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reports.base import style
from reports.facts import measures
from reports.figures.shielding.facts import MONITORED
from reports.page import PageText
from reports.panels import (
    Animation,
    AnimationAxis,
    AnimationClip,
    ColourField,
    DashedDisc,
    measured_overlay,
    round_up,
)
from reports.study import DRIVEN, ReportScene, StudyResults, from_dataset, middle_of_top_edge

_CAPTION = (
    "<b>a</b> Reference, altered and cloaked structures; hatched pads clamp the corners, the arrow "
    "is the drive, the dashed circle bounds the cloak. "
    "<b>b</b> Loss against evaluation: mean over the load angles (thick) and each angle (thin); "
    "rejected evaluations are dots, infeasible ones pale, circles the best feasible designs. "
    "<b>c</b> Snapshots over the last drive cycle at true size, coloured by |U|. "
    "<b>d</b> Vertical displacement of the middle unit of the top edge; dots mark the snapshots. "
    "<b>e</b> Loss over loading angle and frequency; stars mark the loads designed for."
)


def shielding_text(study: StudyResults) -> PageText:
    """What the page says of itself."""
    return PageText(
        credit=(
            "After Figure 2 of Bordiga et al., “Nonlinear mechanical metamaterial cloaks”; every "
            "number here is computed from the datasets."
        ),
        figure_title="Shielding dynamic excitations",
        caption=_CAPTION + measured_overlay.caption(study.recordings),
        headline=("mean_reduction", "loss_end", "peak_to_peak_reduction", "map_max"),
        player_note="The dot marks the unit of panel d.",
    )


def shielding_animation(study: StudyResults) -> Animation:
    """What the player shows: altered and cloaked structures under every load."""
    scene, response = study.scene, study.response
    clips: list[AnimationClip] = []
    times = response["time"].values
    for name in ("altered", "cloaked"):
        part = response.sel(structure=name)
        structure = from_dataset(part, scene.spacing)
        motion = part["displacement"].transpose("case", "time", "unit", "dof").values
        colour, marker = style.STRUCTURE_COLOURS[name], middle_of_top_edge(structure)
        simulated = AnimationClip(name.capitalize(), colour, structure, motion, marker)
        own = [each for each in study.recordings if each.structure == name]
        clips += [*measured_overlay.clips(own, simulated, times, scene.spacing), simulated]
    angles = [f"α = {angle:g}°" for angle in response["direction"].values]
    speeds = {"¼ of real time": 0.25, "⅛": 0.125, "½": 0.5, "real time": 1.0}
    axis = AnimationAxis("t", "s", times, 3, True, speeds)
    discs = [DashedDisc(*scene.middle, radius, style.CLOAKED) for radius in scene.radii]
    start = measures.nearest_case(response, MONITORED)
    fields = _fields(scene, clips)
    return Animation(axis, angles, clips, fields, discs, start=start, pad=scene.spacing)


def _fields(scene: ReportScene, clips: Sequence[AnimationClip]) -> list[ColourField]:
    others = clips[0].structure.support != DRIVEN
    motion = np.concatenate([clip.motion[:, :, others] for clip in clips])
    size = float(np.nanmax(np.linalg.norm(motion / scene.scale, axis=-1)))
    rise, turn = (float(np.nanmax(np.abs(motion[..., k]))) for k in (1, 2))
    scale = (scene.spacing, scene.spacing, 1.0)
    degrees = 180.0 / np.pi
    rise, turn = round_up(rise), round_up(degrees * turn)
    return [
        ColourField("norm", "|U|", "", 1.0, "magnitude", (0.0, round_up(size)), scale),
        ColourField("uy", "u_y", "mm", 1.0, "signed", (-rise, rise)),
        ColourField("theta", "θ", "°", degrees, "signed", (-turn, turn)),
    ]
