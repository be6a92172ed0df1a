"""Composes several studies side by side: structures at the start and at full load, and curves."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import count

from matplotlib.figure import Figure

from reports.base import prose, scale_wide_numbers, style
from reports.figures import loading_path
from reports.figures.loading_path import (
    LoadLegend,
    UnitColouring,
    abscissa_of,
    curves,
    load_names,
    measures,
    shade_bar,
    shade_of,
    snapshot,
    snapshot_margin,
    structures,
)
from reports.panels import Panel, PanelFigure
from reports.study import StudyResults, display_name

_PROSE = prose(__file__)
PER_BAND = 2
"""Studies beside one another, each with its altered and its cloaked structure."""

LABEL, LONG_LABEL, BAR, GAP = 4.0, 6.5, 15.0, 1.0
"""Room left of structures, and where labels name load cases; for the bar; between; mm."""
CURVES, PER_ROW = 46.0, 4
TALLEST = 110.0
"""Height in mm that all bands of structures may take, with a legend of several loads."""
SMALLEST = 15.0
"""Side of a structure below which the first load is shown alone, mm."""


def several_studies_figure(studies: Sequence[StudyResults]) -> PanelFigure:
    """Returns the whole figure: bands of two studies, then the curves of all."""
    first = studies[0]
    bands = [studies[k : k + PER_BAND] for k in range(0, len(studies), PER_BAND)]
    columns, loads = 1 + 2 * min(PER_BAND, len(studies)), load_names(first.problem, first.response)
    label = LABEL if len(loads) == 1 else LONG_LABEL
    widest = (style.TWO_COLUMNS - label - BAR) / columns
    legend = LoadLegend.of(first)
    tallest = TALLEST - legend.height
    sides = [min(widest, tallest / ((1 + count) * len(bands))) for count in (len(loads), 1)]
    shown = loads if sides[0] >= SMALLEST else loads[:1]
    side = sides[0] if shown == loads else sides[1]
    tall = 11.0 + (1 + len(shown)) * side + 4.0
    n_curves = sum(len(_curve_titles(study)) for study in studies)
    shades = [shade_of(study.problem, study.response) for study in studies]
    shade = max(shades, key=lambda shade: shade.field.limits[1])  # one range of colours for all
    letters = map(style.numbered_letter, count())
    panels = [
        panel
        for k, band in enumerate(bands)
        for panel in _band(band, shade, (label, k * tall, side), letters, shown)
    ]
    places = count()
    for study in studies:
        panels += _curves(study, places, len(bands) * tall, letters, legend)
    draft = [reason for study in studies for reason in study.draft]
    colours = re.sub(r"_(\w)", r"<sub>\1</sub>", shade.field.label)
    alone = _PROSE["alone"].format(load=loads[0]) if shown != loads else ""
    remark = f" {_PROSE['snapshots'].format(shade=colours)}{alone}"
    low = len(bands) * tall + -(-n_curves // PER_ROW) * CURVES
    panels[-1] = replace(panels[-1], draw=_with_legend(panels[-1], legend, low))
    return PanelFigure(low + legend.height + 1.0, panels, draft, remark)


def _with_legend(panel: Panel, legend: LoadLegend, top: float) -> Callable[[Figure], None]:
    """Returns what draws a panel, and the legend of all curves `top` mm below the page's edge."""

    def draw(figure: Figure) -> None:
        if panel.draw is not None:
            panel.draw(figure)
        legend.draw(figure, top)

    return draw


def _band(
    band: Sequence[StudyResults],
    shade: UnitColouring,
    place: tuple[float, float, float],
    letters: Iterator[str],
    loads: Sequence[str],
) -> Iterator[Panel]:
    """Yields a panel of the intact structure, and one of each study; the last one draws all."""
    left, top, side = place
    first = band[0]
    columns = [(first, "intact")] if "intact" in structures(first.response) else []
    at = (left, top + 9.5, side)
    starts = [len(columns) + 2 * k for k in range(len(band))]
    columns += [(study, name) for study in band for name in ("altered", "cloaked")]
    if len(columns) > 2 * len(band):
        yield Panel((next(letters), "Reference", 0.0, top), None, _PROSE["reference"])
    draws = [
        *([None] * (len(band) - 1)),
        lambda figure: _structures(figure, columns, shade, at, loads),
    ]
    for study, start, draw in zip(band, starts, draws, strict=True):
        head = next(letters), style.literal(heading(study)), left + start * side, top
        yield Panel(head, draw, _PROSE["structures"].format(name=heading(study)))


def _structures(
    figure: Figure,
    columns: Sequence[tuple[StudyResults, str]],
    shade: UnitColouring,
    place: tuple[float, float, float],
    loads: Sequence[str],
) -> None:
    """Draws structures at rest, and below at full load, a row for each of the `loads`."""
    label, top, side = place
    parts = [(study.problem, study.response.sel(structure=name)) for study, name in columns]
    rows = [(0, 0), *((case, -1) for case in range(len(loads)))]
    margin = max(
        snapshot_margin(problem, part, (0, -1), case)
        for problem, part in parts
        for case in range(len(loads))
    )
    for k, (study, name) in enumerate(columns):
        problem, part = parts[k]
        for row, (case, sample) in enumerate(rows):
            left, y = label + k * side, top + row * side
            axes = style.place(figure, left, y, side - GAP, side - GAP)
            snapshot(axes, problem, part, sample, shade, case, margin)
            if row == 0:
                title, colour = display_name(study.problem, name), style.STRUCTURE_COLOURS[name]
                axes.set_title(title, color=colour, fontsize=style.TEXT, pad=1.0)
    _row_labels(figure, columns[0][0], rows, place, loads)
    right = label + len(columns) * side
    shade_bar(figure, shade, (right + 0.5, top, len(rows) * side - GAP))


def _row_labels(
    figure: Figure,
    study: StudyResults,
    rows: Sequence[tuple[int, int]],
    place: tuple[float, float, float],
    loads: Sequence[str],
) -> None:
    """Tells how far rows are loaded, and under which load case if there are several."""
    label, top, side = place
    way = abscissa_of(study.problem, study.response)
    several = study.response.sizes["case"] > 1
    for row, (case, sample) in enumerate(rows):
        words, y = f"{way.symbol} = {way.at(sample)}", top + (row + 0.5) * side
        if several and sample:
            words = f"{loads[case]}\n{words}"
        style.write_upwards(figure, label - 1.0, y, words, fontsize=style.SMALL)


def heading(study: StudyResults) -> str:
    """Returns what a study is called beside others: the last part of its folder's name."""
    return study.name.rpartition("_")[2].capitalize()


def _curve_titles(study: StudyResults) -> tuple[str, ...]:
    """Names the curves of a study: its measure, and the contraction where that is lateral."""
    title = measures.measure_of(study.problem).label
    lateral = measures.contracts_freely(study.problem, study.response)
    return (title, "contraction") if lateral else (title,)


def _curves(
    study: StudyResults,
    places: Iterator[int],
    top: float,
    letters: Iterator[str],
    legend: LoadLegend,
) -> Iterator[Panel]:
    """Yields measure and contraction of a study, at the next places in rows of four panels."""
    way, measure = abscissa_of(study.problem, study.response), measures.measure_of(study.problem)
    width = style.TWO_COLUMNS / PER_ROW
    label = f"{measure.label[0].lower()}{measure.label[1:]}"
    words = {"name": heading(study), "measure": label, "marks": loading_path.marks([study])}
    for half, title in enumerate(_curve_titles(study)):
        row, column = divmod(next(places), PER_ROW)
        left, y = column * width, top + row * CURVES

        def draw(figure: Figure, left: float = left, y: float = y, half: int = half) -> None:
            axes = style.place(figure, left + 10.5, y + 11.5, width - 14.0, 25.0)
            if half == 0:
                curves.measure_panel(axes, study, way, measure, legend.entries)
            else:
                curves.contraction_panel(axes, study, way)
            scale_wide_numbers(axes)

        head = next(letters), f"{style.literal(heading(study))}, {title.lower()}", left, y
        yield Panel(head, draw, _PROSE[("measure", "contraction")[half]].format_map(words))
