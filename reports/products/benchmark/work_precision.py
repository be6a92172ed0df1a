"""Draws time against error, one point a setting: of losses, and of gradients over losses."""

from __future__ import annotations

from collections.abc import Mapping

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
_SCENES, _TALL = 3, 42.0
_PLAIN = {"central differences": ("ESDIRK3, band", "Newton, band")}
"""Methods without a loss of their own, and those that they take it from."""


def draw_work_precision(data: xr.Dataset) -> Figure:
    """Draws the diagrams of one scene at two-column width."""
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
    """Draws median time, with the range of the runs, against the error of a quantity."""
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


def draw_gradients(scenes: Mapping[str, xr.Dataset]) -> Figure:
    """Draws a panel a scene."""
    rows = -(-len(scenes) // _SCENES)
    methods = list(dict.fromkeys(m for data in scenes.values() for m in _methods(data)))
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


def _methods(data: xr.Dataset) -> list[str]:
    measured = (data["outcome"].values == "measured") & (data["task"].values == "gradient")
    return [str(method) for method in dict.fromkeys(data["method"].values[measured])]


def _costs(axes: Axes, data: xr.Dataset) -> None:
    losses = times(data, "loss")
    for method in _methods(data):
        found = {key: time for key, time in times(data, "gradient").items() if key[0] == method}
        plain = [method, *_PLAIN.get(method, ())]
        points = [
            (errors(data)[key], time / loss)
            for key, time in found.items()
            if np.isfinite(loss := _loss(losses, plain, key[1]))
        ]
        if points:
            error, cost = np.array(points).T
            axes.plot(
                np.maximum(error, ROUNDING), cost, linewidth=0.8, markersize=3.5,
                **marks.drawn(method),
            )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="error of the gradient, relative")
    axes.grid(color=style.PALE, linewidth=0.4)


def _loss(losses: Mapping[tuple[str, str], float], methods: list[str], setting: str) -> float:
    """Returns time of the loss by one of the methods: at that setting, or at its first."""
    for method in methods:
        known = {key[1]: time for key, time in losses.items() if key[0] == method}
        if known:
            return known.get(setting, next(iter(known.values())))
    return float("nan")


def times(data: xr.Dataset, task: str) -> dict[tuple[str, str], float]:
    """Returns median time of every measured point of a task, by method and setting."""
    chosen = data.isel(
        point=np.flatnonzero((data["task"].values == task) & (data["outcome"].values == "measured"))
    )
    medians = np.nanmedian(chosen["cpu_time"].values, axis=1)
    keys = zip(chosen["method"].values, chosen["setting"].values, strict=True)
    return {(str(m), str(s)): float(t) for (m, s), t in zip(keys, medians, strict=True)}


def errors(data: xr.Dataset) -> dict[tuple[str, str], float]:
    """Returns error of the gradient of every point, by method and setting."""
    chosen = data.isel(point=np.flatnonzero(data["task"].values == "gradient"))
    keys = zip(chosen["method"].values, chosen["setting"].values, strict=True)
    found = chosen["error"].sel(quantity="gradient").values
    return {(str(m), str(s)): float(e) for (m, s), e in zip(keys, found, strict=True)}
