"""The figure of the gains: losses of the altered structure and of both designs, and changes."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reports.base import style

_ROW, _LEFT, _WIDE, _GAP = 11.0, 42.0, 60.0, 10.0
_AGAINST = {
    "loss_altered": ("altered", style.ALTERED, "D"),
    "loss_plain": ("study's design", style.GREY, "o"),
    "loss_own": ("preset's design", style.CLOAKED, "o"),
}


def draw_robust_gains(data: xr.Dataset) -> Figure:
    """The figure at two-column width.

    Args:
        data: the gains.
    """
    high = _ROW * data.sizes["preset"]
    figure = style.page(16.0 + high + 11.0)
    style.letter(figure, 1.0, 1.0, "a", "Loss under what the preset asks for")
    right = _LEFT + _WIDE + _GAP
    style.letter(figure, right - 6.0, 1.0, "b", "Against the study's own design")
    _losses(style.place(figure, _LEFT, 16.0, _WIDE, high), data)
    _changes(style.place(figure, right, 16.0, _WIDE, high), data)
    return figure


def _rows(axes: Axes, data: xr.Dataset) -> np.ndarray:
    place = np.arange(data.sizes["preset"])
    axes.set(ylim=(len(place) - 0.5, -0.5), yticks=place)
    axes.tick_params(axis="y", length=0)
    return place


def _losses(axes: Axes, data: xr.Dataset) -> None:
    place = _rows(axes, data)
    unit = data["loss_own"].attrs["units"]
    axes.set(xscale="log", xlabel="loss" if unit == "1" else f"loss ({unit})")
    axes.set_yticklabels([str(name) for name in data["preset"].values])
    axes.hlines(place, data["loss_own"], data["loss_altered"], color=style.PALE, linewidth=1.0)
    for name, (label, colour, marker) in _AGAINST.items():
        axes.plot(data[name], place, marker, color=colour, label=label, markersize=4.0)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, columnspacing=0.8)


def _changes(axes: Axes, data: xr.Dataset) -> None:
    """How much less loss the preset's design has, and how much more it pays for that."""
    place = _rows(axes, data)
    axes.set_yticklabels([])
    axes.axvline(0.0, color=style.GREY, linewidth=0.6)
    for values, colour, marker, label in (
        (data["loss_own"] / data["loss_plain"], style.CLOAKED, "o", "under the preset's loads"),
        (data["price"] / data["loss_drive"], style.GREY, "s", "under the study's drive"),
    ):
        change = 100 * (values.values - 1)
        axes.plot(change, place, marker, color=colour, label=label, markersize=4.0)
    axes.set(xlabel="change of the loss (%)")
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.legend(loc="lower left", bbox_to_anchor=(-0.04, 1.0), ncols=2, columnspacing=0.8)
