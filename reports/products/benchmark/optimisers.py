"""Optimisers: the best feasible loss against evaluations and time, and their profile."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style

LEVELS = (0.3, 0.1, 0.03)
"""Shares of the possible decrease that may be left when a problem counts as solved."""
COLOURS = {
    "own sqp": style.METHOD_COLOURS["sqp"],
    "own mma": style.METHOD_COLOURS["mma"],
    "scipy SLSQP": "#8a5a2b",
    "scipy trust-constr": "#c99a5b",
    "nlopt MMA": "#2f86b4",
    "nlopt CCSAQ": "#17427f",
    "nlopt SLSQP": "#a3304a",
    "nlopt AUGLAG": style.GREY,
}
_AXES = (
    ("evaluations", "best_loss", "best loss, of the first"),
    ("processor time, s", "best_loss", ""),
    ("evaluations", "kkt_residual", "KKT residual, mm"),
)
_HIGH, _ROW = 36.0, 52.0


def draw_optimisers(scenes: Mapping[str, xr.Dataset]) -> Figure:
    """Draws a row a scene, and the profile over all."""
    figure = style.page(len(scenes) * _ROW + 62.0)
    for row, (name, data) in enumerate(scenes.items()):
        for column, (along, what, label) in enumerate(_AXES):
            left, top = 14.0 + 57.0 * column, 9.0 + row * _ROW
            axes = style.place(figure, left, top, 43.0, _HIGH)
            _draw_histories(axes, data, along, what)
            axes.set(xlabel=along, ylabel=label, yscale="log")
        style.letter(figure, 2.0, 1.0 + row * _ROW, "abcdefgh"[row], name)
    top = len(scenes) * _ROW
    style.letter(figure, 2.0, top + 1.0, "abcdefgh"[len(scenes)], "Profile")
    axes = style.place(figure, 14.0, top + 9.0, 70.0, 40.0)
    _profile(axes, scenes)
    lines, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(
        lines, labels, loc="upper left", ncols=2, bbox_transform=axes.transAxes,
        bbox_to_anchor=(1.1, 1.0),
    )  # fmt: skip
    return figure


def _draw_histories(axes: Axes, data: xr.Dataset, along: str, what: str) -> None:
    first = float(data["loss"].isel(evaluation=0).max())
    for name in data["optimiser"].values:
        course = data.sel(optimiser=name)
        known = np.isfinite(course[what].values)
        steps = np.arange(1, len(known) + 1) if along == "evaluations" else course["cpu_time"]
        values = course[what].values / (first if what == "best_loss" else 1.0)
        axes.plot(
            np.asarray(steps)[known], values[known], color=COLOURS[str(name)], label=str(name),
            drawstyle="steps-post", linewidth=0.9,
        )  # fmt: skip


def costs(scenes: Mapping[str, xr.Dataset]) -> dict[str, list[float]]:
    """Finds evaluations that each optimiser needs for every scene and level; infinite if never."""
    found: dict[str, list[float]] = {}
    for data in scenes.values():
        best = data["best_loss"]
        first, least = float(data["loss"].isel(evaluation=0).max()), float(best.min())
        for level in LEVELS:
            solved = (best <= least + level * (first - least)).values
            for name, row in zip(data["optimiser"].values, solved, strict=True):
                needed = float(row.argmax() + 1) if row.any() else np.inf
                found.setdefault(str(name), []).append(needed)
    return found


def _profile(axes: Axes, scenes: Mapping[str, xr.Dataset]) -> None:
    """Draws share of the problems solved within so many times the evaluations of the fastest."""
    found = costs(scenes)
    fastest = np.min(list(found.values()), axis=0)
    most = 32.0
    for name, needed in found.items():
        ratio = np.sort(np.array(needed) / fastest)
        share = np.arange(1, len(ratio) + 1) / len(ratio)
        solved = np.isfinite(ratio) & (ratio <= most)
        along = np.concatenate([[1.0], ratio[solved], [most]])
        up = np.concatenate([[0.0], share[solved], [share[solved].max(initial=0.0)]])
        axes.plot(along, up, drawstyle="steps-post", color=COLOURS[name], linewidth=1.0)
    axes.set(
        xscale="log", xlim=(1.0, most), ylim=(0.0, 1.03),
        xlabel="evaluations over those of the fastest", ylabel="share of problems solved",
    )  # fmt: skip
