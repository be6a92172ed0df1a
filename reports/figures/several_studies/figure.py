"""Several studies side by side at a journal's two-column width: start and full load, and curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from string import ascii_lowercase

from matplotlib.figure import Figure

from reports.base import style
from reports.figures.loading_path import (
    Abscissa,
    UnitColouring,
    colour_bar,
    course,
    curves,
    display_name,
    measures,
    shade_of,
    snapshot,
    structures,
)
from reports.study import StudyResults, draft

PER_BAND = 2
"""Studies beside one another, each with its altered and its cloaked structure."""

LEFT, BAR, GAP = 4.0, 15.0, 1.0
CURVES = 46.0
TALLEST = 110.0
"""Height in mm that all bands of structures may take."""


def draw_several_studies(studies: Sequence[StudyResults]) -> Figure:
    """The whole figure: bands of two studies, then the curves of all."""
    bands = [studies[k : k + PER_BAND] for k in range(0, len(studies), PER_BAND)]
    side = (style.TWO_COLUMNS - LEFT - BAR) / (1 + 2 * min(PER_BAND, len(studies)))
    side = min(side, TALLEST / (2 * len(bands)))
    tall = 11.0 + 2 * side + 4.0
    rows = -(-2 * len(studies) // 4)
    figure = style.page(len(bands) * tall + rows * CURVES + 1.0)
    shade = _common_shade(studies)
    letters = iter(ascii_lowercase)
    for k, band in enumerate(bands):
        _band(figure, band, shade, (k * tall, side), letters)
    _curves(figure, studies, len(bands) * tall, letters)
    if any(study.draft for study in studies):
        draft.mark(figure)
    return figure


def _common_shade(studies: Sequence[StudyResults]) -> UnitColouring:
    """One range of colours for all: the widest."""
    shades = [shade_of(study.problem, study.response) for study in studies]
    return max(shades, key=lambda shade: shade.field.limits[1])


def _band(
    figure: Figure,
    band: Sequence[StudyResults],
    shade: UnitColouring,
    place: tuple[float, float],
    letters: Iterator[str],
) -> None:
    top, side = place
    first = band[0]
    way = course(first.problem, first.response)
    columns = [(first, "intact")] if "intact" in structures(first.response) else []
    style.letter(figure, 0.0, top, next(letters))
    for study in band:
        at = LEFT + len(columns) * side
        style.letter(figure, at, top, next(letters), heading(study))
        columns += [(study, "altered"), (study, "cloaked")]
    for k, (study, name) in enumerate(columns):
        for row, sample in enumerate((0, -1)):
            left, y = LEFT + k * side, top + 9.5 + row * side
            axes = style.place(figure, left, y, side - GAP, side - GAP)
            snapshot(axes, study.problem, study.response.sel(structure=name), sample, shade)
            if row == 0:
                axes.set_title(
                    display_name(study.problem, name),
                    color=style.STRUCTURE_COLOURS[name],
                    fontsize=style.TEXT,
                    pad=1.0,
                )
    _loads(figure, way, top + 9.5, side)
    right = LEFT + len(columns) * side
    colour_bar(figure, shade, (right + 0.5, top + 9.5, 2 * side - GAP))


def _loads(figure: Figure, way: Abscissa, top: float, side: float) -> None:
    for row, sample in enumerate((0, -1)):
        style.write(
            figure,
            3.0,
            top + (row + 0.5) * side,
            f"{way.symbol} = {way.at(sample)}",
            rotation=90,
            ha="right",
            va="center",
            fontsize=style.SMALL,
        )


def heading(study: StudyResults) -> str:
    """What a study is called beside others: the last part of its folder's name."""
    return study.name.rpartition("_")[2].capitalize()


def _curves(
    figure: Figure, studies: Sequence[StudyResults], top: float, letters: Iterator[str]
) -> None:
    """Measure and contraction of every study, four panels a row."""
    whole = style.TWO_COLUMNS / 4
    for k, study in enumerate(studies):
        problem, response = study.problem, study.response
        way, measure = course(problem, response), measures.measure_of(problem)
        y = top + (2 * k // 4) * CURVES
        for half in range(2):
            at = ((2 * k + half) % 4) * whole
            title = measure.label if half == 0 else "contraction"
            style.letter(figure, at, y, next(letters), f"{heading(study)}, {title.lower()}")
            axes = style.place(figure, at + 10.5, y + 11.5, whole - 14.0, 25.0)
            if half == 0:
                curves.measure_panel(axes, study, way, measure)
            else:
                curves.contraction_panel(axes, study, way)
