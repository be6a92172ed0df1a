"""Draws the figure of a quality report: residuals and uncertainty, in space and time."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.tracking.geometry import SpecimenOutlines
from reports.base import style
from reports.products.tracking.overlay import of_track
from reports.products.tracking.track_quality import TrackQuality

_REASONS = {
    "out_of_frame": style.GREY,
    "hidden": style.INTACT,
    "glare": "#e8c547",
    "poor_fit": style.ALTERED,
    "strayed": "#b03060",
}
_SIZE, _TOP = 50.0, 9.0


def draw_quality(track: xr.Dataset, found: TrackQuality, load_axis: str) -> Figure:
    """Draws maps above, courses below: over time, or over the displacement of the driven units."""
    drawn = style.page(132.0)
    if track.attrs["synthetic"] == "yes":
        drawn.text(0.99, 0.005, SYNTHETIC_LABEL, ha="right", va="bottom", color=style.ALTERED)
    specimen = of_track(track)
    there = np.isin(track["unit"].values, specimen.ids)
    residual = track["camera_residual"].values[there]
    sigma = track["sigma"].transpose("time", "unit", "dof").values[:, there]
    scale = np.array([1 / found.pixel, 1 / found.pixel, 180 / np.pi])
    sigma = sigma * scale
    place, turn = np.hypot(sigma[..., 0], sigma[..., 1]) / np.sqrt(2), sigma[..., 2]
    maps = [
        ("a", "First frame less design, px", np.hypot(*residual.T)),
        ("b", "Uncertainty of the place, px", _percentiles(place.T, [50])[0]),
        ("c", "Uncertainty of the rotation, deg", _percentiles(turn.T, [50])[0]),
    ]
    for column, (letter, title, values) in enumerate(maps):
        left = 2.0 + 60.0 * column
        style.letter(drawn, left, 1.0, letter, title)
        axes = style.place(drawn, left, _TOP, _SIZE, _SIZE)
        shown = _map(axes, specimen, values)
        bar = style.place(drawn, left + _SIZE - 3.0, _TOP + 12.0, 1.8, _SIZE - 24.0)
        drawn.colorbar(shown, cax=bar)
    _arrows(drawn.axes[0], specimen, residual)
    _draw_trajectories(drawn, track, found, place, _axis(track, load_axis))
    return drawn


def _percentiles(values: np.ndarray, percents: list[int]) -> np.ndarray:
    """Returns percentiles of the rows (rows, n) over what is known; NaN of rows without."""
    known = np.isfinite(values).any(axis=1)
    out = np.full((len(percents), len(values)), np.nan)
    out[:, known] = np.nanpercentile(values[known], percents, axis=1)
    return out


def _map(axes: Axes, specimen: SpecimenOutlines, values: np.ndarray) -> PolyCollection:
    outlines = [specimen.centre[k] + specimen.polygon(k) for k in range(specimen.count)]
    most = float(np.nanpercentile(values, 98)) if np.isfinite(values).any() else 1.0
    shown = PolyCollection(outlines, edgecolors=style.INTACT, linewidths=0.15)
    shown.set(array=values, cmap=style.MAGNITUDE, norm=Normalize(0, max(most, 1e-9)))
    axes.add_collection(shown)
    points = np.concatenate(outlines)
    low, high = points.min(axis=0), points.max(axis=0)
    spare = 0.18 * (high[0] - low[0])  # room for the colour bar
    axes.set(xlim=(low[0], high[0] + spare), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()
    return shown


def _arrows(axes: Axes, specimen: SpecimenOutlines, residual: np.ndarray) -> None:
    """Directions of the residuals; pixels count downwards."""
    x, y = specimen.centre.T
    longest = max(float(np.nanpercentile(np.hypot(*residual.T), 98)), 1e-9)
    reach = longest / np.sqrt(np.median(specimen.area))
    right, up = residual[:, 0], -residual[:, 1]
    look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "color": style.ALTERED}
    axes.quiver(x, y, right, up, scale=reach, width=0.005, **look)


def _axis(track: xr.Dataset, load_axis: str) -> tuple[np.ndarray, str]:
    if load_axis == "time":
        return track["time"].values, "time, s"
    moved = track["drive_displacement"].values
    far = np.nan_to_num(np.linalg.norm(moved, axis=1))
    direction = moved[far.argmax()] / max(far.max(), 1e-9)
    return moved @ direction, "displacement of the driven units, mm"


def _draw_trajectories(
    drawn: Figure,
    track: xr.Dataset,
    found: TrackQuality,
    sigma: np.ndarray,  # (frames, units) of the place, px
    axis: tuple[np.ndarray, str],
) -> None:
    load, label = axis
    style.letter(drawn, 2.0, 66.0, "d", "Units that are lost, by reason")
    axes = style.place(drawn, 14.0, 73.0, 70.0, 47.0)
    for name, share in zip(found.reasons, found.lost.T, strict=True):
        if share.any():
            reason = name.replace("_", " ")
            axes.plot(load, 100 * share, color=_REASONS[name], label=reason, drawstyle="steps-mid")
    if found.lost.any():
        axes.legend(loc="best")
    else:
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center")
    first, last = np.nanmin(load), np.nanmax(load)
    span = (first, last) if first < last else None
    axes.set(xlabel=label, ylabel="of the units, %", xlim=span, ylim=(0, None))
    style.letter(drawn, 92.0, 66.0, "e", "Uncertainty of the place: median, 90 % of the units")
    axes = style.place(drawn, 104.0, 73.0, 70.0, 47.0)
    low, middle, high = _percentiles(sigma, [5, 50, 95])
    axes.fill_between(load, low, high, color=style.PALE, linewidth=0)
    axes.plot(load, middle, color=style.INTACT)
    if np.isfinite(found.floor[0]):
        floor = float(np.hypot(*found.floor[:2]) / np.sqrt(2))
        axes.axhline(floor, color=style.ALTERED, linestyle="--", label="scatter at rest")
        axes.legend(loc="best")
    for flag, colour in ((1, style.ALTERED), (2, style.CLOAKED)):
        for moment in load[track["timing"].values == flag]:
            axes.axvline(moment, color=colour, linewidth=0.5)
    axes.set(xlabel=label, ylabel="px", ylim=(0, None))
