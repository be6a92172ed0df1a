"""Draws several designs under own and worst loads: their front, and what limits them."""

import argparse
from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline import datasets, problem
from pipeline.posing import greatest_loss
from pipeline.problem.sections import designs, split_name, split_value
from reports.base import Table, prose, style
from reports.facts import headed_columns
from reports.page import FigureText, PageTable, figure_page, publish, titled
from reports.panels import Panel, PanelFigure
from sim.core import Floats

PER_ROW = 3
"""Panels in a row, at most; four stand two by two."""
_PROSE = prose(__file__)
_COLUMNS = (
    "design", "differs by", "value", "drive's own loads{unit}", "worst found{unit}",
    "before any design{unit}", "worst of random loads{unit}", "over their mean",
    "worst of the certificate's searches{unit}",
)  # fmt: skip
_NAMES = {
    "cloak.disc.radius": "radius of the cloak",
    "constraints.edge_length": "shortest edge",
    "constraints.block_angle": "sharpest corner",
}
_HIGH, _LEFT, _HEAD, _ROW, _GAP = 44.0, 13.0, 8.0, 63.0, 4.0
_APART = 0.12
"""Share of a front's extent that points are apart which have a label."""
_WORST, _OWN = style.CLOAKED, style.METHOD_COLOURS["mma"]


def report(args: argparse.Namespace) -> None:
    """Makes the report that a command line asks for."""
    data = datasets.read(args.front, "front")
    ends = {path.parent.name.partition("@")[2]: path for path in args.certificates}
    certified = {name: datasets.read(path, "certificate") for name, path in ends.items()}
    drawn = front_figure(data, certified)
    title = titled(problem.load(args.problem), args.problem)
    lead = _PROSE["lead"].format(count=data.sizes["design"])
    text = FigureText(title, _PROSE["subject"], lead, drawn.caption)
    shown = losses_table(data, certified)
    made = figure_page("front", text, drawn.draw, drawn.tables, data, shown=shown)
    publish(made, args.out_dir)


def losses_table(data: xr.Dataset, certified: Mapping[str, xr.Dataset]) -> PageTable:
    """Tabulates the losses of every design, and those that its certificate found."""
    heads = [column.format(unit=_unit(data)) for column in _COLUMNS]
    return PageTable(heads, [_row(data.sel(design=name), certified) for name in _designs(data)])


def _designs(data: xr.Dataset) -> list[str]:
    return [str(name) for name in data["design"].values]


def _row(point: xr.Dataset, certified: Mapping[str, xr.Dataset]) -> tuple[str, ...]:
    name = str(point["design"].item())
    words = (name, str(point["parameter"].item()), str(point["setting"].item()))
    losses = (f"{float(point[key]):.4g}" for key in ("nominal_loss", "worst_loss", "altered_loss"))
    if name not in certified:
        return *words, *losses, "", "", ""
    of = certified[name].sel(design="cloaked")
    worst = float(of["loss"].max())
    over = worst / float(of["loss"].mean())
    return *words, *losses, f"{worst:.4g}", f"{over:.2f}", f"{float(of['found_loss'].max()):.4g}"


def front_figure(data: xr.Dataset, certified: Mapping[str, xr.Dataset]) -> PanelFigure:
    """Returns the figure: the front, then both losses over every other parameter."""
    presets = [split_name(name)[0] for name in _designs(data)]
    series = [data.isel(design=np.array(presets) == name) for name in dict.fromkeys(presets)]
    series.sort(key=lambda each: _parameter(each) != designs.SHARE)
    count = 2 if len(series) == PER_ROW + 1 else PER_ROW
    each_wide = (style.TWO_COLUMNS + _GAP) / count
    columns = headed_columns(data, *map(str, data.variables))
    table = Table("front.csv", "losses of every design", columns)
    panels = []
    for k, each in enumerate(series):
        place = (k % count) * each_wide, (k // count) * _ROW, each_wide - _GAP
        panels.append(
            _panel(style.numbered_letter(k), each, certified, place, [] if k else [table])
        )
    return PanelFigure(-(-len(series) // count) * _ROW, panels)


def _parameter(series: xr.Dataset) -> str:
    return str(series["parameter"].values[0])


def _panel(
    letter: str,
    series: xr.Dataset,
    certified: Mapping[str, xr.Dataset],
    place: tuple[float, float, float],
    tables: list[Table],
) -> Panel:
    """Describes one panel at a place: mm from left and top, and its width."""
    left, top, wide = place
    name = _NAMES.get(_parameter(series), _parameter(series))
    is_front = _parameter(series) == designs.SHARE

    def draw(figure: Figure) -> None:
        axes = style.place(figure, left + _LEFT, top + _HEAD, wide - _LEFT, _HIGH)
        if is_front:
            _front(axes, series, certified)
        else:
            _losses(axes, series, name, legend=letter in {"a", "b"})

    title = "Own loads against the worst" if is_front else f"Over the {name}"
    caption = _PROSE["front"] if is_front else _PROSE["series"].format(parameter=f"the {name}")
    return Panel((letter, title, left, top), draw, caption, tables)


def _front(axes: Axes, series: xr.Dataset, certified: Mapping[str, xr.Dataset]) -> None:
    series = series.dropna("design", subset=["nominal_loss", "worst_loss"])
    own, worst = series["nominal_loss"].values, series["worst_loss"].values
    axes.plot(own, worst, "-o", color=_WORST, ms=3.2, lw=0.8)
    for name in (name for name in _designs(series) if name in certified):
        of = certified[name].sel(design="cloaked")
        place = float(series["nominal_loss"].sel(design=name)), greatest_loss(of)
        axes.plot(*place, "s", mfc="none", color=_WORST, ms=5.5, mew=0.8)
    places = np.stack([own, worst], axis=-1)
    size = np.ptp([[0.0, 0.0]] if len(places) == 0 else places, axis=0) + np.finfo(float).tiny
    labelled: list[Floats] = []
    ends_first = sorted(range(len(places)), key=lambda k: 0 < k < len(places) - 1)
    for k in ends_first:
        if all(np.abs((places[k] - other) / size).max() > _APART for other in labelled):
            share = str(series["setting"].values[k])
            style.note(axes, tuple(places[k]), share, (4, 1), ha="left", color=style.GREY)
            labelled.append(places[k])
    unit = _unit(series)
    axes.set(xlabel=f"loss under own loads{unit}", ylabel=f"worst loss{unit}")
    axes.margins(0.12)


def _unit(series: xr.Dataset) -> str:
    unit = series["worst_loss"].attrs["units"]
    return "" if unit == "1" else f" ({unit})"


def _losses(axes: Axes, series: xr.Dataset, name: str, *, legend: bool) -> None:
    settings = [str(setting) for setting in series["setting"].values]
    found = [split_value(setting) for setting in settings]
    numbers = all(found)
    place = np.array([each[0] for each in found if each]) if numbers else np.arange(len(found))
    for key, line, colour, label in (
        ("altered_loss", "--", style.ALTERED, "before any design"),
        ("worst_loss", "-", _WORST, "worst load"),
        ("nominal_loss", "-", _OWN, "own loads"),
    ):
        axes.plot(place, series[key], line, color=colour, marker="o", ms=3.2, lw=1.0, label=label)
    axes.set_xticks(place, [f"{at:g}" for at in place] if numbers else settings)
    style.log_values(axes)
    unit = found[0][1].replace("deg", "°") if found[0] else ""
    axes.set(xlabel=f"{name} ({unit})" if unit else name, ylabel=f"loss{_unit(series)}")
    if legend:
        axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.7))
    axes.margins(x=0.08)
