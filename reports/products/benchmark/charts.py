"""Draws what skipping saves, how time and memory grow, and how well tracking does."""

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style
from reports.products.benchmark import marks, tables

DONE, SKIPPED = "done", "skipped"
_ROW, _LEFT, _WIDE = 8.0, 44.0, 84.0
_BARS = {DONE: style.GREY, SKIPPED: style.CLOAKED}
FITTED = {"units": 900, "cases": 10}
"""Fewest that the exponents are fitted to: below, fixed costs count."""
_VIDEOS = (style.CLOAKED, style.METHOD_COLOURS["mma"], "#2f86b4", "#8a5a2b", "#a3304a", style.GREY)
_DASHES = {"own tracker": "-", "plain OpenCV": ":"}


def draw_ablation(data: xr.Dataset) -> Figure:
    """Draws bars of time, how many times less it takes, and what the result changes by."""
    found = tables.points(data)
    names = list(dict.fromkeys(found["method"]))
    high = len(names) * _ROW
    figure = style.page(high + 24.0)
    axes = style.place(figure, _LEFT, 10.0, _WIDE, high)
    for row, name in enumerate(names):
        chosen = found[found["method"] == name]
        times = chosen.set_index("setting")["time, s"]
        for offset, setting in ((-0.18, DONE), (0.18, SKIPPED)):
            axes.barh(row + offset, times[setting], height=0.34, color=_BARS[setting])
        change = np.nanmax(chosen.filter(like="error of "), initial=0.0)
        told = f"{times[DONE] / times[SKIPPED]:.2f} ×,  change {change:.1e}"
        axes.text(1.03, row, told, transform=axes.get_yaxis_transform(), va="center")
    axes.set_yticks(range(len(names)), names)
    axes.set(xscale="log", xlabel="processor time of one run, s", ylim=(len(names) - 0.5, -0.5))
    for setting, colour in _BARS.items():
        axes.bar(0, 0, color=colour, label=setting)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure


def draw_growth(data: xr.Dataset) -> Figure:
    """Draws time and peak memory against the number of units or of cases, with fitted exponents."""
    figure, left, right = _pair(66.0, ("Time", "Memory"))
    measured, of = tables.measured(data), "cases" if "cases" in data["work"].to_numpy() else "units"
    for axes, column in ((left, "time, s"), (right, "peak, MiB")):
        _lines(axes, measured, of, column)
    left.set(ylabel="processor time, s", yscale="log")
    right.set(ylabel="peak memory, MiB", ylim=(0, 1.1 * measured["peak, MiB"].max()))
    left.legend(loc="upper left")
    right.legend(loc="lower right")
    for axes in (left, right):
        axes.set(xlabel=of, xscale="log")
        axes.grid(color=style.PALE, linewidth=0.4)
    return figure


def exponent(sizes: np.ndarray, values: np.ndarray, least: int) -> float:
    """Fits the power law through the sizes from ``least`` on; NaN with fewer than two."""
    large = sizes >= least
    if large.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(sizes[large]), np.log(values[large]), 1)[0])


def _lines(axes: Axes, measured: pd.DataFrame, of: str, column: str) -> None:
    for method, found in measured.groupby("method", sort=False):
        sizes, values = found[of].to_numpy(), found[column].to_numpy()
        power = exponent(sizes, values, FITTED[of])
        told = "" if np.isnan(power) else rf", $n^{{{power:.2f}}}$"
        look = {"linewidth": 0.8, "markersize": 3.5, **marks.drawn(str(method))}
        axes.plot(sizes, values, label=f"{method}{told}", **look)


def _pair(height: float, titles: tuple[str, str]) -> tuple[Figure, Axes, Axes]:
    figure = style.page(height)
    left = style.place(figure, 14.0, 9.0, 66.0, 46.0)
    right = style.place(figure, 106.0, 9.0, 66.0, 46.0)
    style.letter(figure, 2.0, 1.0, "a", titles[0])
    style.letter(figure, 94.0, 1.0, "b", titles[1])
    return figure, left, right


def draw_tracking_accuracy(data: xr.Dataset) -> Figure:
    """Draws displacement on the left, rotation on the right; a colour a video, dashes a method."""
    figure, left, right = _pair(80.0, ("Displacement", "Rotation"))
    error = data["error"]
    _accuracies(left, data, (error.sel(dof=["ux", "uy"]) ** 2).mean("dof") ** 0.5)
    _accuracies(right, data, error.sel(dof="theta") * (180 / np.pi))
    left.set(ylabel="rms error, mm")
    right.set(ylabel="rms error, deg")
    lines, labels = left.get_legend_handles_labels()
    figure.legend(lines, labels, loc="lower center", ncols=3)
    return figure


def _accuracies(axes: Axes, data: xr.Dataset, error: xr.DataArray) -> None:
    for colour, video in zip(_VIDEOS * 2, data["video"].to_numpy(), strict=False):
        for method in data["tracker"].to_numpy():
            axes.plot(
                data["frame_rate"].sel(video=video), error.sel(video=video, tracker=method),
                color=colour, linestyle=_DASHES[str(method)], marker="o", markersize=3.0,
                linewidth=0.8, label=f"{video}, {method}",
            )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="frame rate, Hz")
    axes.grid(color=style.PALE, linewidth=0.4)
