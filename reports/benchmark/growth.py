"""How time and memory grow with the number of units."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports import style
from reports.benchmark import marks

FITTED = 900
"""Fewest units that the exponents are fitted to: below, fixed costs count."""
_MIB = 2.0**20


def build(data: xr.Dataset) -> Figure:
    """Time and peak memory against the number of units, with fitted exponents."""
    figure = style.page(66.0)
    left = style.place(figure, 14.0, 9.0, 66.0, 46.0)
    right = style.place(figure, 106.0, 9.0, 66.0, 46.0)
    style.letter(figure, 2.0, 1.0, "a", "Time")
    style.letter(figure, 94.0, 1.0, "b", "Memory")
    measured = data.isel(point=np.flatnonzero(data["outcome"].values == "measured"))
    times = np.nanmedian(measured["cpu_time"].values, axis=1)
    _lines(left, measured, times, fitted=True)
    _lines(right, measured, measured["memory"].values / _MIB, fitted=False)
    left.set(ylabel="processor time, s", yscale="log")
    right.set(ylabel="peak memory, MiB", ylim=(0, None))
    left.legend(loc="upper left")
    right.legend(loc="lower right")
    for axes in (left, right):
        axes.set(xlabel="units", xscale="log")
        axes.grid(color=style.PALE, linewidth=0.4)
    return figure


def exponent(units: np.ndarray, times: np.ndarray) -> float:
    """Of the power law through the larger sizes; NaN with fewer than two of them."""
    large = units >= FITTED
    if large.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(units[large]), np.log(times[large]), 1)[0])


def _lines(axes: Axes, data: xr.Dataset, values: np.ndarray, *, fitted: bool) -> None:
    for method in dict.fromkeys(data["method"].values):
        at = np.flatnonzero(data["method"].values == method)
        units = data["units"].values[at]
        power = exponent(units, values[at]) if fitted else np.nan
        told = "" if np.isnan(power) else rf", $n^{{{power:.2f}}}$"
        axes.plot(
            units, values[at], linewidth=0.8, markersize=3.5, label=f"{method}{told}",
            **marks.drawn(str(method)),
        )  # fmt: skip
