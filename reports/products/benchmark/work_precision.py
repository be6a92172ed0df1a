"""Work-precision diagrams: processor time against error, one point a setting."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style
from reports.products.benchmark import marks

PANELS = (("displacement", "loss"), ("loss", "loss"), ("gradient", "gradient"))
"""Quantity of a panel, and the task whose time is drawn."""
_WORDS = {
    "displacement": "error of the displacement, relative",
    "loss": "error of the loss, relative",
    "gradient": "error of the gradient, relative",
}
ROUNDING = 1e-16
"""Errors are drawn from here on: less is no difference of floating point numbers."""
_COLUMNS, _LINE = 4, 3.6
_LEFT, _TOP, _WIDE, _HIGH, _PITCH = 12.0, 9.0, 45.0, 45.0, 58.0


def draw_work_precision(data: xr.Dataset) -> Figure:
    """The diagrams of one scene at two-column width."""
    methods = list(dict.fromkeys(data["method"].values[_measured(data)]))
    rows = -(-len(methods) // _COLUMNS)
    figure = style.page(_TOP + _HIGH + 13.0 + rows * _LINE)
    for number, (quantity, task) in enumerate(PANELS):
        left = _LEFT + number * _PITCH
        axes = style.place(figure, left, _TOP, _WIDE, _HIGH)
        style.letter(figure, left - 10.0, 1.0, "abc"[number], quantity.capitalize())
        panel(axes, data, quantity, task)
        axes.set(xlabel=_WORDS[quantity])
    figure.axes[0].set_ylabel("processor time of the loss, s")
    figure.axes[-1].set_ylabel("of loss and gradient, s")
    figure.legend(
        handles=marks.handles(methods), loc="lower center", ncols=_COLUMNS, fontsize=style.SMALL
    )
    return figure


def panel(axes: Axes, data: xr.Dataset, quantity: str, task: str) -> None:
    """Median time, with the range of the runs, against the error of a quantity."""
    chosen = data.isel(point=np.flatnonzero((data["task"].values == task) & _measured(data)))
    error = np.maximum(chosen["error"].sel(quantity=quantity).values, ROUNDING)
    times = chosen["cpu_time"].values
    median = np.nanmedian(times, axis=1)
    spread = [median - np.nanmin(times, axis=1), np.nanmax(times, axis=1) - median]
    for method in dict.fromkeys(chosen["method"].values):
        at = np.flatnonzero(chosen["method"].values == method)
        axes.errorbar(
            error[at],
            median[at],
            yerr=[side[at] for side in spread],
            linewidth=0.8,
            elinewidth=0.5,
            markersize=3.5,
            **marks.drawn(str(method)),
        )
    axes.set(xscale="log", yscale="log")
    axes.grid(color=style.PALE, linewidth=0.4)
    axes.set_axisbelow(True)


def _measured(data: xr.Dataset) -> np.ndarray:
    return data["outcome"].values == "measured"
