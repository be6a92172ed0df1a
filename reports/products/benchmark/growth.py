"""How time and memory grow with the number of units, or of cases."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style
from reports.products.benchmark import marks

FITTED = {"units": 900, "cases": 10}
"""Fewest that the exponents are fitted to: below, fixed costs count."""
_MIB = 2.0**20


def draw_growth(data: xr.Dataset) -> Figure:
    """Time and peak memory against the number of units or of cases, with fitted exponents."""
    figure = style.page(66.0)
    left = style.place(figure, 14.0, 9.0, 66.0, 46.0)
    right = style.place(figure, 106.0, 9.0, 66.0, 46.0)
    style.letter(figure, 2.0, 1.0, "a", "Time")
    style.letter(figure, 94.0, 1.0, "b", "Memory")
    measured = data.isel(point=np.flatnonzero(data["outcome"].values == "measured"))
    times = np.nanmedian(measured["cpu_time"].values, axis=1)
    of = "cases" if "cases" in data["work"].values else "units"
    sizes = measured["units"] if of == "units" else measured["count"].sel(work="cases")
    memory = measured["memory"].values / _MIB
    for axes, values in ((left, times), (right, memory)):
        _lines(axes, measured["method"].values, sizes.values, values, FITTED[of])
    left.set(ylabel="processor time, s", yscale="log")
    right.set(ylabel="peak memory, MiB", ylim=(0, 1.1 * memory.max()))
    left.legend(loc="upper left")
    right.legend(loc="lower right")
    for axes in (left, right):
        axes.set(xlabel=of, xscale="log")
        axes.grid(color=style.PALE, linewidth=0.4)
    return figure


def exponent(sizes: np.ndarray, values: np.ndarray, least: int) -> float:
    """Of the power law through the sizes from ``least`` on; NaN with fewer than two of them."""
    large = sizes >= least
    if large.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(sizes[large]), np.log(values[large]), 1)[0])


def _lines(
    axes: Axes, methods: np.ndarray, sizes: np.ndarray, values: np.ndarray, least: int
) -> None:
    for method in dict.fromkeys(methods):
        at = np.flatnonzero(methods == method)
        power = exponent(sizes[at], values[at], least)
        told = "" if np.isnan(power) else rf", $n^{{{power:.2f}}}$"
        axes.plot(
            sizes[at], values[at], linewidth=0.8, markersize=3.5, label=f"{method}{told}",
            **marks.drawn(str(method)),
        )  # fmt: skip
