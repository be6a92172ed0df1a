"""Composes Figure 2 of the paper: panels with their tables, text of the page, animation."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from reports.base import Table, prose, style
from reports.facts import Columns, Fact, headed, history, measures, vertices
from reports.figures.loading_path import credit
from reports.figures.shielding.curves import loss_panel, map_panel, motion_panel
from reports.figures.shielding.facts import MONITORED, monitored_recordings
from reports.figures.shielding.structure_panels import (
    problem_panel,
    recorded_rows,
    simulated_rows,
    snapshots_panel,
)
from reports.figures.shielding.sweep_map import frequency_map
from reports.page import PageText, study_text
from reports.panels import (
    Animation,
    AnimationClip,
    DashedDisc,
    Panel,
    PanelFigure,
    case_labels,
    measured_overlay,
    signed_field,
    size_field,
    structure_clip,
    time_axis,
    with_recordings,
)
from reports.study import DRIVEN, ReportScene, StudyResults, from_dataset, middle_of_top_edge

TALLEST_SNAPSHOTS = 122.0
"""Height in mm that the snapshots may take however many rows there are."""

SNAPSHOT = 40.0
"""Side of a snapshot in mm where there is room."""
_PROSE = prose(__file__)


def shielding_figure(study: StudyResults) -> PanelFigure:
    """Returns the whole figure."""
    scene, design, response = study.scene, study.design, study.response
    sweep = frequency_map(study.sweep)
    simulated = simulated_rows(scene, response)
    names = [row.name for row in simulated]
    recordings = monitored_recordings(study)
    recorded = recorded_rows(scene, response, recordings, simulated[0].time)
    rows = sorted([*recorded, *simulated], key=lambda row: names.index(row.name))
    height = min(SNAPSHOT * len(rows), TALLEST_SNAPSHOTS)
    top = 51.5
    low = top + 8.5 + height + 1.0
    direction = measures.case_direction(response, MONITORED)
    load = f"$α$ = {direction:g}°"
    quoted = study.problem.report.paper is not None

    most = float(sweep["loss"].max())
    told = f"largest $J$ = {most:.3g}" if np.isfinite(most) else "no results"

    def loss(figure: Figure) -> None:
        loss_panel(style.place(figure, 133.5, 8.5, 43.5, 31.5), design, quoted)

    def motion(figure: Figure) -> None:
        axes = style.place(figure, 11.0, low + 6.0, 93.0, 36.0)
        motion_panel(axes, scene, response, simulated, recordings)

    def losses(figure: Figure) -> None:
        axes = style.place(figure, 118.5, low + 6.0, 43.0, 36.0)
        map_panel(figure, axes, style.place(figure, 163.5, low + 6.0, 2.4, 36.0), scene, sweep)

    shapes, over = vertices(design), "loss over loading angle and frequency (panel e)"
    middle = "motion of the middle unit of the top edge, every load case (panel d)"
    panels = [
        Panel(
            ("a", "", 0.0, 0.8),
            lambda figure: _problem(figure, scene, design, direction),
            _PROSE["a"],
            [Table("design.csv", "vertices of the cloaked and of the initial design", shapes)],
        ),
        Panel(
            ("b", "Optimisation", 123.0, 0.8),
            loss,
            _PROSE["b"],
            [Table("loss_history.csv", "loss against evaluation (panel b)", history(design))],
        ),
        Panel(
            ("c", f"Response over one drive cycle, {load}", 0.0, top),
            lambda figure: snapshots_panel(figure, scene, rows, top + 8.5, height),
            _PROSE["c"],
        ),
        Panel(
            ("d", f"Middle unit of the top edge, {load}", 0.0, low),
            motion,
            _PROSE["d"],
            [Table("top_edge.csv", middle, _top_edge(scene, response))],
        ),
        Panel(
            ("e", f"Robustness, {told}", 109.0, low),
            losses,
            _PROSE["e"],
            [Table("robustness.csv", over, _map(sweep))],
        ),
    ]
    remark = measured_overlay.caption(study.recordings, "above" if recorded else "")
    return PanelFigure(low + 51.0, panels, study.draft, remark)


def shielding_text(study: StudyResults, caption: str, facts: Sequence[Fact]) -> PageText:
    """Returns what the page says of itself."""
    return study_text(
        study,
        caption,
        facts,
        credit=credit(study.problem.report.paper),
        headline=("mean_reduction", "loss_end", "loss_copies", "peak_to_peak_reduction", "map_max"),
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


def _problem(figure: Figure, scene: ReportScene, design: xr.Dataset, direction: float) -> None:
    side = 40.0
    radius = scene.radii[-1]
    notes = {
        "reference": f"{scene.columns} × {scene.rows} units, $s$ = {scene.spacing:g} mm",
        "altered": f"$A$ = {scene.amplitude:g} mm, $f$ = {scene.frequency:g} Hz",
        "cloaked": f"$R$ = {radius / scene.spacing:g}$s$ = {radius:g} mm",
    }
    for k, (name, note) in enumerate(notes.items()):
        left = k * (side + 0.6)
        axes = style.place(figure, left, 6.0, side, side)
        corners = "vertices" if name == "cloaked" else "vertices_initial"
        problem_panel(axes, scene, from_dataset(design, scene.spacing, corners), name, direction)
        colour = style.STRUCTURE_COLOURS[name]
        axes.set_title(name.capitalize(), color=colour, fontsize=style.TITLE, pad=2.0)
        style.write(figure, left + side / 2, 46.2, note, ha="center", fontsize=style.SMALL)


def _top_edge(scene: ReportScene, response: xr.Dataset) -> Columns:
    """Returns one row a time: ux, uy, theta of both structures under every load."""
    unit = middle_of_top_edge(from_dataset(response.isel(structure=0), scene.spacing))
    series = response["displacement"].isel(unit=unit)
    columns = {"time_s": response["time"].values}
    for name in response["structure"].values:
        for case, angle in enumerate(response["direction"].values):
            for dof, unit_name in (("ux", "mm"), ("uy", "mm"), ("theta", "rad")):
                values = series.sel(structure=name, dof=dof).isel(case=case).values
                columns[f"{name}_{angle:g}deg_{dof}_{unit_name}"] = values
    return columns


def _map(sweep: xr.Dataset) -> Columns:
    angle, rate = np.meshgrid(sweep["direction"], sweep["frequency"], indexing="ij")
    columns = {"direction_deg": angle.ravel(), "frequency_Hz": rate.ravel()}
    for column, name in (
        ("J_cloaked", "loss"),
        ("J_altered", "loss_altered"),
        ("min_void_angle", "min_void_angle"),
        ("status", "status"),
    ):
        values = sweep[name].transpose("direction", "frequency")
        columns[headed(column, values.attrs.get("units", "1"))] = values.values.ravel()
    return columns
