"""The figure of structures along a path, at a journal's two-column width."""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style
from reports.figures.loading_path import curves, measures
from reports.figures.loading_path.abscissa import (
    Abscissa,
    course,
    display_name,
    lattice_size,
    structures,
)
from reports.figures.loading_path.snapshot_grid import SnapshotLayout, snapshots
from reports.figures.loading_path.structure_panels import rest_panel
from reports.panels import loss_history
from reports.study import StudyResults, draft

TALLEST_SNAPSHOTS = 116.0
"""Height that all snapshots may take, mm."""

Panel = tuple[str, Callable[[Axes], None]]


def draw_loading_path(study: StudyResults) -> Figure:
    """The whole figure."""
    path = course(study.problem, study.response)
    names = structures(study.response)
    grid = SnapshotLayout.of(study, path, TALLEST_SNAPSHOTS)
    top = 52.0
    head = 11.5 if study.recordings else 8.5
    low = top + head + grid.lines * grid.side + 2.0
    figure = style.page(low + 48.0)
    at_rest(figure, study, names)
    style.letter(figure, 123.0, 0.8, "b", "Optimisation")
    loss_history(style.place(figure, 133.5, 8.5, 43.5, 31.5), study.design, loss_label(study))
    style.letter(figure, 0.0, top, "c", "Response, true to scale")
    snapshots(figure, study, grid, top + head)
    _curves(figure, _panels(study, path), low)
    if study.draft:
        draft.mark(figure)
    return figure


def loss_label(study: StudyResults) -> str:
    """Symbol and unit of the loss."""
    return "Loss (N mm)" if study.problem.objective.kind == "strain_energy" else r"Loss $J$"


def at_rest(figure: Figure, study: StudyResults, names: tuple[str, ...]) -> list[Axes]:
    """Panel a: the structures side by side, and how large and how driven they are."""
    style.letter(figure, 0.0, 0.8, "a")
    side = 40.0
    lattice, drive = study.problem.lattice, study.problem.drive
    size = f"{lattice_size(lattice)} units, $s$ = {lattice.spacing:g} mm"
    notes = [size, f"$A$ = {drive.amplitude:g} mm" if hasattr(drive, "amplitude") else "", ""]
    left = (3 - len(names)) * (side + 0.6) / 2
    panels = []
    for k, name in enumerate(names):
        x = left + k * (side + 0.6)
        axes = style.place(figure, x, 6.0, side, side)
        rest_panel(axes, study.problem, study.response, name)
        colour = style.STRUCTURE_COLOURS[name]
        axes.set_title(
            display_name(study.problem, name), color=colour, fontsize=style.TITLE, pad=2.0
        )
        style.write(figure, x + side / 2, 46.6, notes[k], ha="center", fontsize=style.SMALL)
        panels.append(axes)
    return panels


def _panels(study: StudyResults, path: Abscissa) -> list[Panel]:
    """Curves below the snapshots, left to right."""
    problem, measure = study.problem, measures.measure_of(study.problem)
    panels: list[Panel] = [
        (measure.label, lambda axes: curves.measure_panel(axes, study, path, measure))
    ]
    if path.static and problem.objective.target != "rest":
        panels.append(
            ("Lateral contraction", lambda axes: curves.contraction_panel(axes, study, path))
        )
    panels.append(("Reaction", lambda axes: curves.reaction_panel(axes, study, path)))
    if (copies := study.scatter) is not None:
        title = f"{copies['sample'].size} imperfect cloaks"
        panels.append((title, lambda axes: curves.robustness_panel(axes, study, measure, copies)))
    return panels


def _curves(figure: Figure, panels: list[Panel], top: float) -> None:
    """The panels side by side, lettered from d."""
    whole = style.TWO_COLUMNS / len(panels)
    for k, (title, draw) in enumerate(panels):
        left = k * whole
        style.letter(figure, left, top, "defg"[k], title)
        draw(style.place(figure, left + 11.0, top + 11.5, whole - 14.0, 27.0))
