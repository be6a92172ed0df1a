"""Draws time against error, one point a setting: of losses, and of gradients over losses."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style
from reports.products.benchmark import marks, tables

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
_SCENES, _TALL = 3, 42.0
PLAIN = {"central differences": ("ESDIRK3, panels", "Newton, band")}
"""Methods without a loss of their own, and those that they take it from."""


def draw_work_precision(data: xr.Dataset) -> Figure:
    """Draws the diagrams of one scene at two-column width."""
    methods = list(dict.fromkeys(tables.measured(data)["method"]))
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
    """Draws median time, with the range of the runs, against the error of a quantity."""
    for method, found in tables.measured(data, task).groupby("method", sort=False):
        error, median = np.maximum(found[f"error of {quantity}"], ROUNDING), found["time, s"]
        spread = [median - found["least, s"], found["most, s"] - median]
        look = {"elinewidth": 0.5, **marks.drawn(str(method))}
        axes.errorbar(error, median, yerr=spread, linewidth=0.8, markersize=3.5, **look)
    axes.set(xscale="log", yscale="log")
    axes.grid(color=style.PALE, linewidth=0.4)
    axes.set_axisbelow(True)


def draw_gradients(scenes: Mapping[str, xr.Dataset]) -> Figure:
    """Draws a panel a scene."""
    rows = -(-len(scenes) // _SCENES)
    shown = [tables.measured(data, "gradient")["method"] for data in scenes.values()]
    methods = list(dict.fromkeys(method for each in shown for method in each))
    lines = -(-len(methods) // 4)
    figure = style.page(rows * (_TALL + 20.0) + 3.6 * lines + 2.0)
    for number, (name, data) in enumerate(scenes.items()):
        row, column = divmod(number, _SCENES)
        left, top = 12.0 + 58.0 * column, 9.0 + row * (_TALL + 20.0)
        axes = style.place(figure, left, top, _WIDE, _TALL)
        style.letter(figure, left - 10.0, top - 8.0, "abcdefgh"[number], name)
        _costs(axes, data)
        if column == 0:
            axes.set_ylabel("time of loss and gradient\nover that of the loss")
    figure.legend(handles=marks.handles(methods), loc="lower center", ncols=4)
    return figure


def _costs(axes: Axes, data: xr.Dataset) -> None:
    losses = dict(list(tables.measured(data, "loss").groupby("method")))
    for method, found in tables.measured(data, "gradient").groupby("method", sort=False):
        plain = [losses[name] for name in (method, *PLAIN.get(str(method), ())) if name in losses]
        if plain:  # the loss at that setting, or at the first
            known = plain[0].set_index("setting")["time, s"]
            loss = found["setting"].map(known).fillna(known.iloc[0])
            error = np.maximum(found["error of gradient"], ROUNDING)
            look = {"linewidth": 0.8, "markersize": 3.5, **marks.drawn(str(method))}
            axes.plot(error, found["time, s"] / loss, **look)
    axes.set(xscale="log", yscale="log", xlabel="error of the gradient, relative")
    axes.grid(color=style.PALE, linewidth=0.4)
