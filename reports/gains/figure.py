"""The figure of the gains: losses of the altered structure, of both designs, and the price."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports import style

_ROW, _LEFT, _WIDE, _GAP = 11.0, 42.0, 60.0, 10.0
_AGAINST = {
    "loss_altered": ("altered", style.ALTERED, "D"),
    "loss_plain": ("the study's own design", style.GREY, "o"),
    "loss_own": ("the preset's design", style.CLOAKED, "o"),
}


def build(data: xr.Dataset) -> Figure:
    """The figure at two-column width.

    Args:
        data: the gains.
    """
    high = _ROW * data.sizes["preset"]
    figure = style.page(16.0 + high + 11.0)
    style.letter(figure, 1.0, 1.0, "a", "Loss under what the preset asks for")
    style.letter(
        figure, _LEFT + _WIDE + _GAP - 6.0, 1.0, "b", "Price: loss under the study's own drive"
    )
    _losses(style.place(figure, _LEFT, 16.0, _WIDE, high), data)
    _price(style.place(figure, _LEFT + _WIDE + _GAP, 16.0, _WIDE, high), data)
    return figure


def _rows(axes: Axes, data: xr.Dataset) -> np.ndarray:
    place = np.arange(data.sizes["preset"])
    axes.set(ylim=(len(place) - 0.5, -0.5), yticks=place, xscale="log")
    axes.set_xlabel(
        f"loss ({unit})" if (unit := data["loss_own"].attrs["units"]) != "1" else "loss"
    )
    axes.tick_params(axis="y", length=0)
    return place


def _losses(axes: Axes, data: xr.Dataset) -> None:
    place = _rows(axes, data)
    axes.set_yticklabels([str(name) for name in data["preset"].values])
    axes.hlines(place, data["loss_own"], data["loss_altered"], color=style.PALE, linewidth=1.0)
    for name, (label, colour, marker) in _AGAINST.items():
        axes.plot(data[name], place, marker, color=colour, label=label, markersize=4.0)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, columnspacing=0.8)


def _price(axes: Axes, data: xr.Dataset) -> None:
    place = _rows(axes, data)
    axes.set_yticklabels([])
    axes.set_xscale("linear")
    axes.plot(data["price"], place, "o", color=style.CLOAKED, markersize=4.0)
    axes.axvline(float(data["loss_drive"]), color=style.GREY, linewidth=0.8)
