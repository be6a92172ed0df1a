"""Describes the figure of a sweep: curves over one parameter, maps over two, points over more.

Points are drawn where the cases are not all combinations of two parameters, however many there are.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pipeline.problem.sections import Sweep
from reports.base import style
from reports.products.sweep import cases
from reports.products.sweep.cases import SweepAxis
from sim.core import Floats

_LEFT, _PITCH, _WIDTH, _HEIGHT = 13.0, 59.0, 44.0, 38.0
_TOP, _ROW = 9.0, 50.0
_MAP_LEFT, _MAP_WIDTH, _BAR = 15.0, 34.5, 2.2
_MANY = 500  # points, above which they are drawn as pixels: a page has to open
_SPARSE, _INK, _SIZES = 100, 22.0, (1.5, 3.5)  # cases; size of points by their root; points
_BINS, _FEWEST = 10, 200  # of medians; below so many cases there are none


class SweepMeasure(NamedTuple):
    """Holds what is shown of every case: values (case) of structures, by colour."""

    title: str
    quantity: str
    unit: str  # empty if it has none
    values: dict[str, Floats]
    level: float | None = None

    @property
    def label(self) -> str:
        """Names the quantity with its unit."""
        return f"{self.quantity} ({self.unit})" if self.unit else self.quantity


def measures(data: xr.Dataset) -> list[SweepMeasure]:
    """Tells what a sweep gathers, in the order of the panels."""
    units = data["loss"].attrs["units"].removeprefix("1")
    both = {style.ALTERED: data["loss_altered"].values, style.CLOAKED: data["loss"].values}
    void = np.degrees(data["min_void_angle"].values)
    ratio, over = {style.CLOAKED: cases.ratio(data)}, "$J$ / $J$ altered"
    return [
        SweepMeasure("Loss", "Loss $J$", units, both),
        SweepMeasure("Loss, cloaked over altered", over, "", ratio, 1.0),
        SweepMeasure("Smallest void angle, cloaked", "Void angle", "°", {style.CLOAKED: void}),
    ]


def draw_sweep(data: xr.Dataset, sweep: Sweep) -> Figure:
    """Draws the figure at two-column width."""
    along, shown = cases.axes(data), measures(data)
    if cases.mapped(sweep):
        return _maps(data, along, shown)
    figure = style.page(_TOP + len(along) * _ROW)
    look = _marker_style(data.sizes["case"], joined=(joined := cases.ordered(sweep)))
    _titles(figure, shown, look)
    for row, axis in enumerate(along):
        for column, measure in enumerate(shown):
            axes = style.place(figure, _LEFT + column * _PITCH, _TOP + row * _ROW, _WIDTH, _HEIGHT)
            _against(axes, axis, measure, look, joined=joined)
            _mark_failures(axes, axis.places[~cases.good(data)])
    return figure


def _marker_style(count: int, *, joined: bool) -> dict[str, Any]:
    """Returns how so many points are drawn: the fewer of them, the larger and the darker."""
    size = float(np.clip(_INK / np.sqrt(count), *_SIZES))
    look: dict[str, Any] = {"markersize": size, "alpha": 0.5 if count > _SPARSE else 0.9, "ls": ""}
    look = {"markersize": 2.5, "alpha": 1.0, "ls": "-"} if joined else look
    return look | {"marker": "o", "markeredgewidth": 0.0}


def _titles(figure: Figure, shown: Sequence[SweepMeasure], look: dict[str, Any]) -> None:
    for column, measure in enumerate(shown):
        style.letter(figure, 1.0 + column * _PITCH, 1.0, "abc"[column], measure.title)
    colours = {"altered": style.ALTERED, "cloaked": style.CLOAKED}
    seen = look | {"alpha": 1.0, "markersize": max(look["markersize"], 2.5)}
    handles = [Line2D([], [], color=colour, label=name, **seen) for name, colour in colours.items()]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.08, 0.995), ncols=2)


def _against(
    axes: Axes, axis: SweepAxis, measure: SweepMeasure, look: dict[str, Any], *, joined: bool
) -> None:
    order = np.argsort(axis.places, kind="stable")
    look = look | {"rasterized": len(order) > _MANY}
    for colour, values in measure.values.items():
        axes.plot(axis.places[order], values[order], color=colour, **look)
        if not joined and not axis.words:
            _median(axes, axis.places, values, colour)
    if measure.level is not None:
        axes.axhline(measure.level, color=style.GREY, lw=0.6, ls=(0, (4, 2)), zorder=1)
    if _is_wide(measure):
        style.log_values(axes)
    _name(axes, axis, "x")
    axes.set_ylabel(measure.label)


def _is_wide(measure: SweepMeasure) -> bool:
    """Tells whether a measure is positive and spans more than a factor of ten."""
    level = [] if measure.level is None else [measure.level]
    values = np.concatenate([*measure.values.values(), level])
    values = values[np.isfinite(values)]
    return len(values) > 0 and bool(0.0 < 10 * values.min() < values.max())


def _median(axes: Axes, places: Floats, values: Floats, colour: str) -> None:
    there = np.isfinite(values)
    if there.sum() < _FEWEST:
        return
    order = np.argsort(places[there], kind="stable")
    parts = np.array_split(order, _BINS)
    middles = [[np.median(each[there][part]) for part in parts] for each in (places, values)]
    axes.plot(*middles, color="white", lw=2.4, zorder=5)
    axes.plot(*middles, color=colour, lw=1.2, zorder=6)


def _mark_failures(axes: Axes, places: Floats) -> None:
    """Draws crosses at the lower edge where cases failed."""
    axes.plot(
        places, np.full(len(places), 0.02), "x", color=style.INTACT, markersize=3,
        markeredgewidth=0.7, transform=axes.get_xaxis_transform(), clip_on=False,
    )  # fmt: skip


def _name(axes: Axes, axis: SweepAxis, which: str) -> None:
    """Draws labels an axis, with words in place of numbers where the values are words."""
    getattr(axes, f"set_{which}label")(axis.label)
    if axis.words:
        getattr(axes, f"set_{which}ticks")(range(len(axis.words)), axis.words)


def _maps(data: xr.Dataset, along: Sequence[SweepAxis], shown: Sequence[SweepMeasure]) -> Figure:
    figure = style.page(_TOP + _ROW)
    for column, measure in enumerate(shown):
        left = _MAP_LEFT + column * _PITCH
        title = "Loss, cloaked" if len(measure.values) > 1 else measure.title
        style.letter(figure, 1.0 + column * _PITCH, 1.0, "abc"[column], title)
        axes = style.place(figure, left, _TOP, _MAP_WIDTH, _HEIGHT)
        bar = style.place(figure, left + _MAP_WIDTH + 1.5, _TOP, _BAR, _HEIGHT)
        first, second = along
        drawn = axes.pcolormesh(
            _edges(first.distinct),
            _edges(second.distinct),
            _on_grid(first, second, measure.values[style.CLOAKED]),
            cmap=style.MAGNITUDE,
        )
        figure.colorbar(drawn, cax=bar)
        bar.tick_params(length=1.5)
        bar.set_title(measure.unit, loc="left", pad=4.0, fontsize=style.SMALL)
        failed = ~cases.good(data)
        axes.plot(
            first.places[failed], second.places[failed], "x", color=style.INTACT, markersize=3,
            markeredgewidth=0.7,
        )  # fmt: skip
        _name(axes, first, "x")
        if column == 0:
            _name(axes, second, "y")
            axes.set_ylabel(second.label.replace(" (", "\n("))  # keys are long
            axes.tick_params("y", rotation=90.0 if second.words else 0.0)
        else:
            axes.tick_params("y", left=False, labelleft=False)
    return figure


def _on_grid(first: SweepAxis, second: SweepAxis, values: Floats) -> Floats:
    """Returns values (second, first) of the cases at the crossings of two axes."""
    spread = np.full((len(second.distinct), len(first.distinct)), np.nan)
    rows, columns = (np.searchsorted(axis.distinct, axis.places) for axis in (second, first))
    spread[rows, columns] = values
    return spread


def _edges(values: Floats) -> Floats:
    """Returns edges of cells about ascending values: halfway between neighbours."""
    if len(values) == 1:
        return values[0] + np.array([-0.5, 0.5])
    middle = (values[1:] + values[:-1]) / 2
    return np.array([2 * values[0] - middle[0], *middle, 2 * values[-1] - middle[-1]])
