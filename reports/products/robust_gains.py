"""Draws what robust presets gain: losses of the altered structure and of both designs."""

import argparse
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pipeline import datasets, problem
from reports.base import Table, prose, style
from reports.facts import headed_columns, worded
from reports.page import FigureText, PageTable, figure_page, publish, titled

_PROSE = prose(__file__)
_COLUMNS = (
    "preset", "asks for", "loads", "copies", "loss of the study's own design{unit}",
    "loss of the preset's design{unit}", "gain", "loss under the study's own drive{unit}",
)  # fmt: skip
_ROW, _LEFT, _WIDE, _GAP = 11.0, 42.0, 60.0, 10.0
_AGAINST = {
    "loss_altered": ("altered", style.ALTERED, "D"),
    "loss_plain": ("study's design", style.GREY, "o"),
    "loss_own": ("preset's design", style.CLOAKED, "o"),
}


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    data = datasets.read(args.gains, "gains")
    columns = headed_columns(data, *(str(name) for name in data.variables if data[name].dims))
    lead = _PROSE["lead"].format(loss=worded(float(data["loss_drive"]), _loss_unit(data), 4))
    title = titled(problem.load(args.problem), args.problem)
    text = FigureText(title, _PROSE["subject"], lead, _PROSE["caption"])
    tables = [Table("gains.csv", "losses of every preset", columns)]
    drawn = partial(draw_robust_gains, data)
    made = figure_page("gains", text, drawn, tables, data, shown=gains_table(data))
    publish(made, args.out_dir)


def gains_table(data: xr.Dataset) -> PageTable:
    """Tabulates losses and gain of every preset."""
    unit = _loss_unit(data)
    heads = [column.format(unit="" if unit == "1" else f" ({unit})") for column in _COLUMNS]
    return PageTable(heads, [_row(data.sel(preset=name)) for name in data["preset"].values])


def _loss_unit(data: xr.Dataset) -> str:
    return str(data["loss_own"].attrs["units"])


def _row(data: xr.Dataset) -> tuple[str, ...]:
    plain, own, price = (float(data[name]) for name in ("loss_plain", "loss_own", "price"))
    words = (str(data[name].item()) for name in ("preset", "asks", "loads", "copies"))
    return *words, f"{plain:.4g}", f"{own:.4g}", f"{1 - own / plain:.1%}", f"{price:.4g}"


def draw_robust_gains(data: xr.Dataset) -> Figure:
    """Draws the figure at two-column width."""
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
    unit = _loss_unit(data)
    axes.set(xscale="log", xlabel="loss" if unit == "1" else f"loss ({unit})")
    axes.set_yticklabels([str(name) for name in data["preset"].values])
    axes.hlines(place, data["loss_own"], data["loss_altered"], color=style.PALE, linewidth=1.0)
    for name, (label, colour, marker) in _AGAINST.items():
        axes.plot(data[name], place, marker, color=colour, label=label, markersize=4.0)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, columnspacing=0.8)


def _changes(axes: Axes, data: xr.Dataset) -> None:
    """Tells how much less loss the preset's design has, and how much more it pays for that."""
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
