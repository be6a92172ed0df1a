"""Draws the loss against the evaluation of the design, for every method, as a panel of a figure."""

import matplotlib.patheffects as effects
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from reports.base import style

FEASIBLE = 1e-6
"""Violation of a constraint (mm, rad) up to which an evaluation counts as feasible."""


def loss_history(axes: Axes, design: xr.Dataset, label: str = r"Loss $J$") -> None:
    """Draws mean loss thick, each load case thin; what was rejected or infeasible is lighter."""
    for method in design["method"].values:
        history = design.sel({"method": method})
        colour = style.METHOD_COLOURS.get(str(method), style.GREY)
        _history(axes, history, colour, str(method).upper())
    style.log_values(axes)
    axes.set(xlabel="Evaluation", ylabel=label, xlim=(0, None))
    axes.set_ylim(0.55 * float(design["loss"].min()), None)
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.01), ncols=2, columnspacing=1.2)


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
    aside = at < loss.size / 2  # where another method's curve may run below
    side = {"ha": "left", "va": "bottom"} if aside else {"ha": "right", "va": "top"}
    shift = (3, 2) if aside else (0, -4.5)
    label = style.note(axes, (at, best), f"{best:.3f}", shift, color=colour, zorder=7, **side)
    label.set_path_effects([effects.withStroke(linewidth=1.5, foreground="white")])
