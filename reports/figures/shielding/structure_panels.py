"""Describes panels of Figure 2 that show structures: the problem (a) and the snapshots (c)."""

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib.patheffects as effects
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Arc

from reports.base import WIDEST_OF_BAR, scale_wide_numbers, style
from reports.facts import measures
from reports.figures.shielding.facts import MONITORED
from reports.panels import (
    CLAMP_TINT,
    CLOAK_TINT,
    colour_bar,
    draw,
    draw_clamps,
    drive_arrows,
    outline,
    round_up,
    tints,
)
from reports.study import (
    CLAMPED,
    CLOAK,
    DRIVEN,
    RecordedMotion,
    ReportScene,
    RigidUnits,
    deformed,
    from_dataset,
    middle_of_top_edge,
)
from sim.core import Floats

PHASES = (0.05, 0.3, 0.55, 0.8)
"""Parts of the last drive cycle that the snapshots show: near both peaks, and after both zeros."""

UNIT_TINT = "#c3c7cc"
_MOTION = ("time", "unit", "dof")


@dataclass(frozen=True)
class SnapshotRow:
    """Describes one row of snapshots: a structure at several times.

    displacement (n_times, n_units, 3) in mm, mm, rad; NaN for units without data. `time` in s.
    """

    name: str
    source: str
    structure: RigidUnits
    time: Floats
    displacement: Floats


def problem_panel(
    axes: Axes, scene: ReportScene, structure: RigidUnits, name: str, direction: float
) -> None:
    """Draws a structure of panel (a), "reference", "altered" or "cloaked", and the drive."""
    draw_clamps(axes, structure, scene.spacing)
    held = {CLAMPED: CLAMP_TINT} | ({DRIVEN: style.ALTERED} if name != "reference" else {})
    altered = {CLOAK: CLOAK_TINT} if name == "cloaked" else {}
    draw(axes, structure, colours=tints(structure, held, altered, UNIT_TINT))
    middle = np.array(scene.middle)
    if name == "reference":
        return
    if name == "cloaked":
        outline(axes, middle, scene.radii, style.CLOAKED)
    if name == "altered":
        _direction(axes, scene, direction)
    reach = (0.75 * scene.spacing, 0.16 * scene.columns * scene.spacing + 0.2 * scene.spacing)
    drive_arrows(axes, middle, direction, reach, style.ALTERED)


def _direction(axes: Axes, scene: ReportScene, direction: float) -> None:
    """Draws the loading angle in degrees, between the x axis and the drive."""
    x, y = scene.middle
    halo: list[effects.AbstractPathEffect] = [effects.withStroke(linewidth=2.0, foreground="white")]
    radius = 0.2 * scene.columns * scene.spacing
    line = axes.plot(
        [x + 0.75 * scene.spacing, x + 1.15 * radius], [y, y], color=style.INTACT, lw=0.6, zorder=6
    )[0]
    arc = Arc((x, y), 1.7 * radius, 1.7 * radius, theta1=0, theta2=direction, lw=0.6, zorder=6)
    axes.add_patch(arc)
    angle = np.radians(0.5 * direction)
    at = (x + 1.12 * radius * np.cos(angle), y + 1.12 * radius * np.sin(angle))
    text = axes.text(*at, r"$\alpha$", fontsize=style.TITLE, ha="center", va="center", zorder=9)
    for artist in (line, arc, text):
        artist.set_path_effects(halo)


def snapshot_times(scene: ReportScene, response: xr.Dataset) -> Floats:
    """Tells when the snapshots are, over the last whole drive cycle, s."""
    end = response["time"].values[-1]
    start = (np.floor(end * scene.frequency * measures.LAST_SAMPLE) - 1.0) * scene.period
    return start + np.array(PHASES) * scene.period


def simulated_rows(scene: ReportScene, response: xr.Dataset) -> list[SnapshotRow]:
    """Finds snapshots of the altered and the cloaked structure over the last whole drive cycle."""
    case = measures.nearest_case(response, MONITORED)
    wanted, rows = snapshot_times(scene, response), []
    for name in ("altered", "cloaked"):
        part = response.sel(structure=name).isel(case=case)
        frames = part["displacement"].sel(time=wanted, method="nearest")
        structure, motion = from_dataset(part, scene.spacing), frames.transpose(*_MOTION).values
        rows.append(SnapshotRow(name, "simulation", structure, frames["time"].values, motion))
    return rows


def recorded_rows(
    scene: ReportScene, response: xr.Dataset, recordings: Sequence[RecordedMotion], times: Floats
) -> list[SnapshotRow]:
    """Finds snapshots of the recordings at given times, s."""
    return [
        SnapshotRow(
            each.structure,
            each.source,
            from_dataset(response.sel(structure=each.structure), scene.spacing),
            times,
            each.at(each.data["measured"], times),
        )
        for each in recordings
    ]


def snapshots_panel(
    figure: Figure, scene: ReportScene, rows: Sequence[SnapshotRow], top: float, height: float
) -> None:
    """Draws panel (c): all rows at one scale, coloured by |U| with one bar."""
    count = max(len(row.time) for row in rows)
    label, bar, gap = 9.0, 14.0, 1.2
    side = min((style.TWO_COLUMNS - label - bar) / count, height / len(rows))
    left = label + (style.TWO_COLUMNS - label - bar - count * side) / 2
    norm = Normalize(0.0, _colour_limit(scene, rows))
    for k, row in enumerate(rows):
        y = top + k * side
        words, colour = f"{row.name.capitalize()}\n{row.source}", style.STRUCTURE_COLOURS[row.name]
        style.write_upwards(figure, left - 1.5, y + side / 2, words, color=colour)
        for m, frame in enumerate(row.displacement):
            axes = style.place(figure, left + m * side, y, side - gap, side - gap)
            _snapshot(axes, scene, row, frame, norm)
            if k == 0:
                text = f"$t$ = {row.time[m]:.3f} s"
                axes.set_title(text, fontsize=style.TEXT, pad=1.0)
    place = (left + count * side + 1.5, top, len(rows) * side - gap)
    made = colour_bar(figure, norm, style.MAGNITUDE, place, r"$\|\mathbf{U}\|$", extend="max")
    scale_wide_numbers(made.ax, WIDEST_OF_BAR)


def _colour_limit(scene: ReportScene, rows: Sequence[SnapshotRow]) -> float:
    """Returns largest |U| outside the source, rounded up."""
    sizes = [
        np.linalg.norm(row.displacement[:, row.structure.support != DRIVEN] / scene.scale, axis=-1)
        for row in rows
    ]
    return round_up(max(float(np.nanmax(size)) for size in sizes))


def _snapshot(
    axes: Axes, scene: ReportScene, row: SnapshotRow, frame: Floats, norm: Normalize
) -> None:
    structure = row.structure
    size = np.linalg.norm(frame / scene.scale, axis=1)
    draw_clamps(axes, structure, scene.spacing)
    draw(axes, structure, frame, values=size, colour_map=style.MAGNITUDE, norm=norm)
    unit = middle_of_top_edge(structure)
    x, y = np.nanmean(deformed(structure, frame)[unit], axis=0)  # at rest where it was lost
    colour = style.STRUCTURE_COLOURS[row.name]
    axes.plot(x, y, "o", ms=3.6, mfc=colour, mec="white", mew=0.6, zorder=8)
