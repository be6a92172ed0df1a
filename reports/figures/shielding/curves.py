"""Draws panels of Figure 2: loss (b), motion of one unit (d), robustness map (e)."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator

from reports.base import scale_wide_numbers, style, typeset
from reports.facts import measures, percent
from reports.figures.shielding.facts import monitored, paper_loss
from reports.figures.shielding.structure_panels import SnapshotRow
from reports.panels import loss_history, loss_label, measured_overlay
from reports.study import RecordedMotion, ReportScene, from_dataset, middle_of_top_edge
from sim.core import Floats


def loss_panel(axes: Axes, design: xr.Dataset, quoted: bool) -> None:
    """Draws panel (b): the histories, with the paper's reduction where the study is the paper's."""
    loss_history(axes, design)
    if quoted:
        _paper_line(axes, design)


def _paper_line(axes: Axes, design: xr.Dataset) -> None:
    target = paper_loss(float(design["loss"].isel(method=0, evaluation=0)))
    axes.axhline(target, color=style.GREY, lw=0.7, ls=(0, (4, 2)), zorder=1)
    axes.set_ylim(min(0.55 * target, axes.get_ylim()[0]), None)
    across = ("axes fraction", "data")
    words, at = "paper’s −70 %", (1.0, target)
    style.note(axes, at, words, ha="right", color=style.GREY, xycoords=across)


def motion_panel(
    axes: Axes,
    scene: ReportScene,
    response: xr.Dataset,
    rows: list[SnapshotRow],
    recordings: Sequence[RecordedMotion],
) -> None:
    """Draws panel (d): u_y of the middle unit of the top edge, peak-to-peak, reduction."""
    series = monitored(scene, response)
    time = series["time"].values
    span = measures.peak_to_peak(series, float(time[-1]))
    axes.axhline(0.0, color=style.PALE, lw=0.5, zorder=1)
    for k, name in enumerate(("altered", "cloaked")):
        curve = series.sel(structure=name).values
        colour = style.STRUCTURE_COLOURS[name]
        axes.plot(time, curve, color=colour, lw=1.2, label=name.capitalize(), zorder=3 + k)
        place = time[-1] * (1.2 - 0.11 * k)
        _span_arrow(axes, place, curve, colour, float(span.sel(structure=name)))
    for row in rows:
        curve = np.interp(row.time, time, series.sel(structure=row.name).values)
        colour = style.STRUCTURE_COLOURS[row.name]
        axes.plot(row.time, curve, "o", ms=2.8, mfc=colour, mec="white", mew=0.4, zorder=6)
    end = float(time[-1])
    unit = middle_of_top_edge(from_dataset(response.isel(structure=0), scene.spacing))
    for each in recordings:
        _measured(axes, each, unit)
    limit = (1.7 if recordings else 1.45) * float(np.abs(series).max())
    axes.set(xlabel="Time $t$ (s)", ylabel="$u_y$ (mm)", xlim=(0, 1.27 * end), ylim=(-limit, limit))
    axes.xaxis.set_major_locator(FixedLocator(list(np.arange(0, end + 1e-9, scene.period / 2))))
    style.short_numbers(axes)
    scale_wide_numbers(axes)
    axes.spines["bottom"].set_bounds(0, end)
    axes.xaxis.set_label_coords(0.5 / 1.27, -0.13)
    lines = [*axes.get_legend_handles_labels()[0], *measured_overlay.handles(recordings)]
    axes.legend(handles=lines, loc="upper left", ncols=3, borderaxespad=0.0, columnspacing=1.0)
    words, right = f"peak-to-peak −{percent(measures.reduction(span))}", axes.transAxes
    axes.text(1.0, 0.01, words, transform=right, ha="right", va="bottom", fontsize=style.TEXT)


def _measured(axes: Axes, recording: RecordedMotion, unit: int) -> None:
    """Draws measured u_y of a unit and the prediction band behind it."""
    colour = style.STRUCTURE_COLOURS[recording.structure]
    motion = recording.data.isel(unit=unit).sel(dof="uy")
    low, high, curve = (
        recording.values(motion[name]) for name in ("band_low", "band_high", "measured")
    )
    measured_overlay.band(axes, recording.along, low, high, colour)
    measured_overlay.measured_curve(axes, recording.along, curve, colour)


def _span_arrow(axes: Axes, at: float, curve: Floats, colour: str, span: float) -> None:
    """Draws bar from the lowest to the highest value of a curve, with its length."""
    low, high = float(curve.min()), float(curve.max())
    caps = {"arrowstyle": "|-|,widthA=0.15,widthB=0.15", "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (at, high), (at, low), arrowprops=caps | {"color": colour, "lw": 0.8})
    style.note(axes, (at, high), f"{typeset(f'{span:.3g}')} mm", color=colour)


def map_panel(figure: Figure, axes: Axes, bar: Axes, scene: ReportScene, sweep: xr.Dataset) -> None:
    """Draws panel (e): loss over loading angle and frequency, stars at the loads designed for."""
    loss = sweep["loss"].transpose("frequency", "direction")
    angle, rate = sweep["direction"].values, sweep["frequency"].values
    if np.isfinite(loss).any():
        low, high = float(loss.min()), float(loss.max())
        levels = MaxNLocator(9, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
        filled = axes.contourf(angle, rate, loss.values, levels, cmap=style.MAGNITUDE)
        axes.contour(angle, rate, loss.values, levels, colors="white", linewidths=0.35)
        figure.colorbar(filled, cax=bar).set_label(loss_label(sweep["loss"]), labelpad=2.0)
        bar.tick_params(length=1.5)
    else:
        bar.set_axis_off()
    failed = np.argwhere((sweep["status"].transpose("frequency", "direction") != "ok").values)
    axes.plot(angle[failed[:, 1]], rate[failed[:, 0]], "x", color=style.INTACT, ms=3, mew=0.7)
    loads = np.array(scene.directions)
    rates = np.full(len(loads), scene.frequency)
    axes.plot(
        loads, rates, "*", ms=7, mfc=style.ALTERED, mec="white", mew=0.5, clip_on=False, zorder=10
    )
    axes.set(xlabel=r"Loading angle $\alpha$ (°)", ylabel="Frequency $f$ (Hz)")
    axes.xaxis.set_major_locator(FixedLocator(list(np.arange(0, angle.max() + 1, 45))))
    axes.yaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
    axes.spines[["top", "right"]].set_visible(True)
