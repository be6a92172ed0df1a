"""Draws the loss against the evaluation of the design, for every method, as a panel of a figure."""

from typing import Any

import matplotlib.patheffects as effects
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from pipeline.posing import FEASIBLE
from reports.base import scale_wide_numbers, style, typeset

SIDES: tuple[tuple[tuple[float, float], dict[str, Any]], ...] = (
    ((0, -4.5), {"ha": "right", "va": "top"}),
    ((3, 2), {"ha": "left", "va": "bottom"}),
    ((0, -4.5), {"ha": "left", "va": "top"}),
    ((0, 4.5), {"ha": "right", "va": "bottom"}),
)
"""Places of a number beside its mark: shifts in points, and which corner is shifted."""
_ROUNDING = 1e-6
"""Share of the least mean loss below which that of a load case is not shown."""


def loss_label(loss: xr.DataArray) -> str:
    """Names a loss on an axis, with its unit if it has one."""
    unit = loss.attrs.get("units", "1")
    return "Loss $J$" if unit == "1" else f"Loss $J$ ({unit})"


def loss_history(axes: Axes, design: xr.Dataset) -> None:
    """Draws mean loss thick, each load case thin; what was rejected or infeasible is lighter."""
    for method in design["method"].values:
        history = design.sel({"method": method})
        colour = style.METHOD_COLOURS.get(str(method), style.GREY)
        _history(axes, history, colour, str(method).upper())
    style.log_values(axes)
    axes.set(xlabel="Evaluation", ylabel=loss_label(design["best_loss"]), xlim=(0, None))
    axes.set_ylim(_lowest(design), None)
    unit = 10.0 ** scale_wide_numbers(axes)
    for method in design["method"].values:
        _name_best(axes, design.sel({"method": method}), unit)
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.01), ncols=2, columnspacing=1.2)


def _lowest(design: xr.Dataset) -> float:
    """Returns the lower limit of the losses: below the mean's, and below that of any load case."""
    mean = float(design["loss"].min())
    cases = design["loss_case"].where(design["accepted"] > 0)
    seen = cases.where(cases > _ROUNDING * mean)  # of a case that is zero but for rounding, none
    return float(np.fmin(0.55 * mean, 0.9 * float(seen.min())))


def _history(axes: Axes, history: xr.Dataset, colour: str, name: str) -> None:
    loss = history["loss"].values
    step = np.arange(loss.size)
    done = np.isfinite(loss)
    accepted = done & (history["accepted"].values > 0)
    good = accepted & (history["violation"].values <= FEASIBLE)
    for curve in history["loss_case"].transpose("case", "evaluation").values:
        axes.plot(step[accepted], curve[accepted], color=colour, lw=0.5, alpha=0.7, zorder=2)
    axes.plot(step[accepted], loss[accepted], color=colour, lw=1.1, alpha=0.35, zorder=3)
    feasible = np.where(good, loss, np.nan)[accepted]
    axes.plot(step[accepted], feasible, color=colour, lw=1.1, label=name, zorder=4)
    outside = done & ~good
    axes.plot(step[outside], loss[outside], ".", color=colour, ms=2.4, mew=0, alpha=0.4, zorder=2)
    at, best = int(history["best_evaluation"]), float(history["best_loss"])
    axes.plot(at, best, "o", ms=3.6, mfc="white", mec=colour, mew=1.0, zorder=6)


def _name_best(axes: Axes, history: xr.Dataset, unit: float) -> None:
    """Writes the best loss beside its mark, on the first side that crosses the least of curves.

    It is in the `unit` of the axis.
    """
    at, best = int(history["best_evaluation"]), float(history["best_loss"])
    colour = style.METHOD_COLOURS.get(str(history["method"].values), style.GREY)
    number = typeset(f"{best / unit:.3g}")
    written = [
        style.note(axes, (at, best), number, shift, color=colour, zorder=7, **corner)
        for shift, corner in SIDES
    ]
    crossed = [_crossed(axes, label.get_window_extent()) for label in written]
    chosen = written[int(np.argmin(crossed))]
    chosen.set_path_effects([effects.withStroke(linewidth=1.5, foreground="white")])
    for label in written:
        if label is not chosen:
            label.remove()


def _crossed(axes: Axes, box: Bbox) -> float:
    """Counts what is drawn under a box in pixels; what is outside the axes is worse than any."""
    inside = axes.bbox.padded(1.0)
    outside = not (inside.contains(box.x0, box.y0) and inside.contains(box.x1, box.y1))
    return 100.0 * outside + sum(_meets(line, box) for line in axes.lines)


def _meets(line: Line2D, box: Bbox) -> bool:
    path = line.get_transform().transform_path(line.get_path())
    if line.get_linestyle() == "None":
        return bool(box.count_contains(path.vertices))
    return path.intersects_bbox(box, filled=False)
