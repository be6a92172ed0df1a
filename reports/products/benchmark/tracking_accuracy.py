"""Error of tracking against frame rate."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.base import style

_COLOURS = (style.CLOAKED, style.METHOD_COLOURS["mma"], "#2f86b4", "#8a5a2b", "#a3304a", style.GREY)
_DASHES = {"own tracker": "-", "plain OpenCV": ":"}


def draw_tracking_accuracy(data: xr.Dataset) -> Figure:
    """Displacement on the left, rotation on the right; a colour a video, dashes a method."""
    figure = style.page(80.0)
    left = style.place(figure, 14.0, 9.0, 66.0, 46.0)
    right = style.place(figure, 106.0, 9.0, 66.0, 46.0)
    style.letter(figure, 2.0, 1.0, "a", "Displacement")
    style.letter(figure, 94.0, 1.0, "b", "Rotation")
    error = data["error"]
    _lines(left, data, (error.sel(dof=["ux", "uy"]) ** 2).mean("dof") ** 0.5)
    _lines(right, data, error.sel(dof="theta") * (180 / np.pi))
    left.set(ylabel="rms error, mm")
    right.set(ylabel="rms error, deg")
    lines, labels = left.get_legend_handles_labels()
    figure.legend(lines, labels, loc="lower center", ncols=3)
    return figure


def _lines(axes: Axes, data: xr.Dataset, error: xr.DataArray) -> None:
    for colour, video in zip(_COLOURS * 2, data["video"].values, strict=False):
        for method in data["tracker"].values:
            axes.plot(
                data["frame_rate"].sel(video=video), error.sel(video=video, tracker=method),
                color=colour, linestyle=_DASHES[str(method)], marker="o", markersize=3.0,
                linewidth=0.8, label=f"{video}, {method}",
            )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="frame rate, Hz")
    axes.grid(color=style.PALE, linewidth=0.4)
