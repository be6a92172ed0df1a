"""The figure of structures that waves run through, at a journal's two-column width."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style
from reports.figures.loading_path import (
    TALLEST_SNAPSHOTS,
    SnapshotLayout,
    SnapshotStructure,
    at_rest,
    course,
    measure_panel,
    measures,
    path_axes,
    snapshots,
    structure_curves,
    structures,
)
from reports.figures.wave import closed_voids
from reports.figures.wave.monitored_places import MonitoredUnit, first_structure, places
from reports.panels import loss_history
from reports.study import StudyResults, deformed, draft, from_dataset

CONTACT = "#e3342f"
"""Colour of marks: of contacts, and of places, as in the paper."""
ROOM = 8.5
"""Between the letter of a row and its panels, mm."""


def draw_wave(study: StudyResults) -> Figure:
    """The whole figure."""
    path = course(study.problem, study.response)
    grid = SnapshotLayout.of(study, path, TALLEST_SNAPSHOTS)
    top = 52.0
    middle = top + ROOM + grid.lines * grid.side + 1.5
    low = middle + 44.0
    figure = style.page(low + 46.0)
    for axes in at_rest(figure, study, structures(study.response)):
        _mark_places(axes, study)
    style.letter(figure, 123.0, 0.8, "b", "Optimisation")
    loss_history(style.place(figure, 133.5, ROOM, 43.5, 31.5), study.design)
    style.letter(figure, 0.0, top, "c", "Response, true to scale; red dots: closed voids")
    snapshots(figure, study, grid, top + ROOM, partial(_contacts, study))
    _places(figure, study, middle)
    _whole(figure, study, low)
    if study.draft:
        draft.mark(figure)
    return figure


def _mark_places(axes: Axes, study: StudyResults) -> None:
    sites = first_structure(study.problem, study.response).site
    for place in places(study.problem, study.response):
        _mark(axes, place, *sites[place.unit])


def _mark(axes: Axes, place: MonitoredUnit, x: float, y: float) -> None:
    size = 6.0 if isinstance(place.mark, tuple) else 3.6
    axes.plot(
        x, y, ls="", marker=place.mark, ms=size, mfc=CONTACT, mec="white", mew=0.5, zorder=9,
        clip_on=False,
    )  # fmt: skip


def _contacts(study: StudyResults, axes: Axes, row: SnapshotStructure, sample: int) -> None:
    """Dots on the ligaments beside which a void is closed."""
    part = row.part.isel(case=0)
    structure = from_dataset(row.part, study.problem.lattice.spacing)
    frame = part["displacement"].isel(time=sample).transpose("unit", "dof").values
    touching = closed_voids.closed(study.problem, part.isel(time=[sample]))[0]
    x, y = closed_voids.middles(structure, deformed(structure, frame))[touching].T
    axes.plot(x, y, ls="", marker="o", ms=2.4, mfc=CONTACT, mec="white", mew=0.3, zorder=8)


def _places(figure: Figure, study: StudyResults, top: float) -> None:
    """u_y over time at each place, side by side."""
    shown = places(study.problem, study.response)
    path, rise = course(study.problem, study.response), study.response["displacement"].sel(dof="uy")
    style.letter(figure, 0.0, top, "d", "Vertical displacement where marked in a")
    whole = style.TWO_COLUMNS / max(len(shown), 1)
    for k, place in enumerate(shown):
        axes = style.place(figure, k * whole + 11.0, top + ROOM, whole - 14.0, 25.0)
        path_axes(axes, path, "$u_y$ (mm)" if k == 0 else "")
        curves = rise.isel(unit=place.unit)
        structure_curves(axes, study.problem, path, curves, structures(study.response))
        reach = 1.25 * float(np.abs(curves).max())
        axes.set_ylim(-reach, reach)
        size = 6.0 if isinstance(place.mark, tuple) else 4.0
        axes.plot(
            0.05, 0.9, ls="", marker=place.mark, ms=size, mfc=CONTACT, mec="white", mew=0.5,
            transform=axes.transAxes,
        )  # fmt: skip
        if k == 0:
            axes.legend(loc="lower left", handlelength=1.2, borderaxespad=0.2)


def _whole(figure: Figure, study: StudyResults, top: float) -> None:
    """Mimicking error, and contacts on the edges, over time."""
    path, half = course(study.problem, study.response), style.TWO_COLUMNS / 2
    style.letter(figure, 0.0, top, "e", "Mimicking error")
    error = style.place(figure, 11.0, top + ROOM, half - 14.0, 27.0)
    measure_panel(error, study, path, measures.measure_of(study.problem))
    style.letter(figure, half, top, "f", "Smallest void angle along the top and bottom edges")
    edges = style.place(figure, half + 11.0, top + ROOM, half - 14.0, 27.0)
    path_axes(edges, path, "angle (°)")
    angles = 180.0 / np.pi * closed_voids.along_edges(study.problem, study.response).min("ligament")
    structure_curves(edges, study.problem, path, angles, structures(study.response))
    cutoff, barrier = np.degrees(
        [study.problem.contact.cutoff_angle, study.problem.contact.barrier_angle]
    )
    edges.axhspan(barrier, cutoff, color=CONTACT, alpha=0.18, lw=0, zorder=1)
    edges.set_ylim(barrier - 4.0, 1.1 * float(angles.max()))
    edges.text(
        0.01, barrier + 0.5 * (cutoff - barrier), "contact", color=CONTACT, fontsize=style.SMALL,
        va="center", transform=edges.get_yaxis_transform(),
    )  # fmt: skip
