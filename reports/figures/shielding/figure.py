"""Figure 2 of the paper at a journal's two-column width, from the datasets of its study."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from reports.base import style
from reports.facts import measures
from reports.figures.shielding.curves import loss_panel, map_panel, motion_panel
from reports.figures.shielding.facts import MONITORED, monitored_recordings
from reports.figures.shielding.structure_panels import (
    problem_panel,
    recorded_rows,
    simulated_rows,
    snapshots_panel,
)
from reports.figures.shielding.sweep_map import frequency_map
from reports.study import ReportScene, StudyResults, draft, from_dataset

TALLEST_SNAPSHOTS = 122.0
"""Height in mm that the snapshots may take however many rows there are."""

SNAPSHOT = 40.0
"""Side of a snapshot in mm where there is room."""


def draw_shielding(study: StudyResults) -> Figure:
    """The whole figure; recorded snapshots stand above the simulated ones of their structure."""
    scene, design, response, sweep = (
        study.scene,
        study.design,
        study.response,
        frequency_map(study.sweep),
    )
    simulated = simulated_rows(scene, response)
    names = [row.name for row in simulated]
    recordings = monitored_recordings(study)
    recorded = recorded_rows(scene, response, recordings)
    rows = sorted([*recorded, *simulated], key=lambda row: names.index(row.name))
    snapshots = min(SNAPSHOT * len(rows), TALLEST_SNAPSHOTS)
    top_c = 51.5
    top_d = top_c + 8.5 + snapshots + 1.0
    figure = style.page(top_d + 51.0)
    direction = measures.case_direction(response, MONITORED)
    load = f"$α$ = {direction:g}°"
    _problem(figure, scene, design, direction)
    style.letter(figure, 123.0, 0.8, "b", "Optimisation")
    quoted = study.problem.report.paper is not None
    loss_panel(style.place(figure, 133.5, 8.5, 43.5, 31.5), design, quoted)
    style.letter(figure, 0.0, top_c, "c", f"Response over one drive cycle, {load}")
    snapshots_panel(figure, scene, rows, top_c + 8.5, snapshots)
    style.letter(figure, 0.0, top_d, "d", f"Middle unit of the top edge, {load}")
    axes = style.place(figure, 11.0, top_d + 6.0, 93.0, 36.0)
    motion_panel(axes, scene, response, simulated, recordings)
    most = f"largest $J$ = {float(sweep['loss'].max()):.3f}"
    style.letter(figure, 109.0, top_d, "e", f"Robustness, {most}")
    axes = style.place(figure, 118.5, top_d + 6.0, 43.0, 36.0)
    map_panel(figure, axes, style.place(figure, 163.5, top_d + 6.0, 2.4, 36.0), scene, sweep)
    if study.draft:
        draft.mark(figure)
    return figure


def _problem(figure: Figure, scene: ReportScene, design: xr.Dataset, direction: float) -> None:
    style.letter(figure, 0.0, 0.8, "a")
    side = 40.0
    radius = scene.radii[-1]
    notes = {
        "reference": f"{scene.columns} × {scene.rows} units, $s$ = {scene.spacing:g} mm",
        "altered": f"$A$ = {scene.amplitude:g} mm, $f$ = {scene.frequency:g} Hz",
        "cloaked": f"$R$ = {radius / scene.spacing:g}$s$ = {radius:g} mm",
    }
    for k, name in enumerate(("reference", "altered", "cloaked")):
        vertices = "vertices" if name == "cloaked" else "vertices_initial"
        axes = style.place(figure, k * (side + 0.6), 6.0, side, side)
        structure = from_dataset(design, scene.spacing, vertices)
        problem_panel(axes, scene, structure, name, direction)
        axes.set_title(
            name.capitalize(), color=style.STRUCTURE_COLOURS[name], fontsize=style.TITLE, pad=2.0
        )
        left = k * (side + 0.6) + side / 2
        style.write(figure, left, 46.2, notes[name], ha="center", fontsize=style.SMALL)
