"""The page of a wave: its words."""

from __future__ import annotations

from dataclasses import replace

from reports.figures.loading_path import content
from reports.page import PageText
from reports.study import StudyResults

_CAPTION = (
    "<b>a</b> The structures at rest: orange units are driven along the arrows, purple ones are "
    "redesigned; red marks are the places of panel d. "
    "<b>b</b> Loss against evaluation; rejected evaluations are dots, infeasible ones pale, the "
    "circle is the best feasible design. "
    "<b>c</b> Snapshots at true size, coloured by u<sub>y</sub>; red dots are ligaments beside "
    "which a void is closed to contact. "
    "<b>d</b> Vertical displacement of the marked units. "
    "<b>e</b> Distance of the surroundings' motion to the intact one, over the largest size of "
    "that in time. "
    "<b>f</b> Smallest void angle along the top and bottom edges; in the red band the units touch."
)


def wave_text(study: StudyResults) -> PageText:
    """What the page says of itself."""
    return replace(
        content.loading_path_text(study),
        caption=_CAPTION,
        headline=("error_altered", "error_cloaked", "error_reduction", "loss_reduction"),
    )
