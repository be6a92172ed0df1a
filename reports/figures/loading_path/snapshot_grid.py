"""Describes structures along the path, true to scale, side by side and above one another."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.textpath import TextPath
from matplotlib.ticker import MaxNLocator

from pipeline.problem import Problem
from pipeline.problem.sections import Lattice
from reports.base import WIDEST_OF_BAR, scale_wide_numbers, style, typeset
from reports.figures.loading_path.abscissa import (
    SECOND,
    Abscissa,
    abscissa_of,
    load_names,
    structures,
)
from reports.figures.loading_path.structure_panels import UnitColouring, shade_of
from reports.panels import MARGIN, colour_bar, draw, frame
from reports.study import StudyResults, deformed, display_name, from_dataset

LABEL, BAR, GAP = 6.0, 14.0, 1.2
"""Room for labels left of snapshots and for the bar of colours, and between snapshots; mm."""
LARGEST = 44.0
"""Longer side of a snapshot where there is room, mm."""
_SLIMMEST = 0.45
"""Least ratio of the sides of a snapshot, so that there is room for labels."""
_NEARLY_SQUARE = 0.8
"""Ratio of a lattice's sides above which its snapshots are square."""

_HEAD, _LINE = 8.5, 3.0
"""Room above snapshots whose labels are of one line, and for each other one, mm."""
_BAND_HEAD = 4.0
"""The same above those that are wrapped, with no title of the panel there, mm."""
_NARROWEST = 12.0
"""Width below which structures side by side are wrapped, mm."""

_GAPS = re.compile(r" (?![^(]*\))")
"""Spaces outside of brackets."""

Label = tuple[str, str]


@dataclass(frozen=True)
class SnapshotStructure:
    """Holds one structure among the snapshots: its name, the colour of that, and what it does.

    `case` is the load case shown.
    """

    label: str
    colour: str
    part: xr.Dataset
    case: int = 0


def rows(study: StudyResults) -> list[SnapshotStructure]:
    """Lists the structures of a study, recordings above them, and the second design."""
    response, problem = study.response, study.problem
    along, found = abscissa_of(problem, response).values, []
    loads = load_names(problem, response)
    for name in structures(response):
        label, colour = display_name(problem, name), style.STRUCTURE_COLOURS[name]
        filmed = [each for each in study.recordings if each.structure == name]
        for each in filmed:
            part, told = each.motion(response, along), f"{label}\n{each.source}"
            told = told if len(loads) == 1 else f"{told}\n{loads[each.case]}"
            found.append(SnapshotStructure(told, colour, part))
        label = f"{label}\nsimulation" if filmed else label
        for case, load in enumerate(loads):
            told = label if len(loads) == 1 else f"{label}\n{load}"
            found.append(SnapshotStructure(told, colour, response.sel(structure=name), case))
    if study.redesign is not None and study.redesign.changed:
        part = study.redesign.response.sel(structure="cloaked")
        for case, load in enumerate(loads):
            told = SECOND if len(loads) == 1 else f"{SECOND}\n{load}"
            found.append(SnapshotStructure(told, style.CLOAKED, part, case))
    return found


@dataclass(frozen=True)
class SnapshotLayout:
    """Tells how the snapshots are laid out: structures above one another or side by side; mm.

    Many side by side are wrapped into `bands`.
    """

    rows: list[SnapshotStructure]
    path: Abscissa
    width: float
    height: float
    beside: bool
    bands: int = 1

    @classmethod
    def of(cls, study: StudyResults, path: Abscissa, tallest: float) -> "SnapshotLayout":
        """Returns the layout that shows them larger.

        They are at most `tallest` (mm) together with all lines of their labels but the first. Where
        that has no room for the labels, structures side by side are wrapped; where that does not do
        either, only the first and the last of the loads are shown, or the last alone.
        """
        kinds, slim = rows(study), _slenderness(study.problem.lattice)
        plain = cls._one_band(kinds, path, tallest, slim)
        if not plain.cramped:
            return plain
        found = plain
        ends = tuple(dict.fromkeys((path.shown[0], path.shown[-1])))
        for shown in dict.fromkeys((path.shown, ends, path.shown[-1:])):
            some = replace(path, shown=shown)
            found = cls._wrapped_bands(kinds, some, tallest, slim)
            if not found.cramped:
                break
        return found

    @classmethod
    def _one_band(
        cls, kinds: list[SnapshotStructure], path: Abscissa, tallest: float, slim: float
    ) -> "SnapshotLayout":
        loads = len(path.shown)
        above = _width(loads, len(kinds), tallest, slim)
        beside = _width(len(kinds), loads, tallest, slim)
        most = max(above, beside)
        return cls(kinds, path, most, slim * most, beside > above)._fitted(tallest, slim)

    @classmethod
    def _wrapped_bands(
        cls, kinds: list[SnapshotStructure], path: Abscissa, tallest: float, slim: float
    ) -> "SnapshotLayout":
        """Returns the layout of structures side by side in as many bands as show them largest."""
        found = []
        for bands in range(1, len(kinds) + 1):
            wide = _width(-(-len(kinds) // bands), bands * len(path.shown), tallest, slim)
            made = cls(kinds, path, wide, slim * wide, True, bands)
            found.append(made._fitted(tallest, slim)._fitted(tallest, slim))  # of narrower labels
        return max(found, key=lambda made: made.width)

    @property
    def cramped(self) -> bool:
        """Tests if structures side by side are narrow, or a word of a label runs into the next."""
        room = (self.width if self.beside else self.height) - GAP
        kinds = self.labels[0 if self.beside else 1]
        lines = [line for text, _ in kinds for line in text.split("\n")]
        narrow = self.beside and self.width < _NARROWEST
        return narrow or max(_length(line, style.SMALL) for line in lines) > room

    def _fitted(self, tallest: float, slim: float) -> "SnapshotLayout":
        """Returns the layout with snapshots no taller than there is room for."""
        room = (tallest - (self.head - _HEAD) - self._heads_until(self.bands - 1)) / self.lines
        room = max(room, 1.0)
        return self if self.height <= room else replace(self, width=room / slim, height=room)

    @property
    def lines(self) -> int:
        """Returns number of snapshots above one another."""
        return self.bands * len(self.path.shown) if self.beside else len(self.rows)

    @property
    def columns(self) -> int:
        """Returns number of snapshots side by side."""
        return -(-len(self.rows) // self.bands) if self.beside else len(self.path.shown)

    @property
    def recorded(self) -> str:
        """Tells where a recording is, seen from its simulation."""
        if self.bands > 1:
            return "left of, or in a band above,"
        return "left of" if self.beside else "above"

    @property
    def left(self) -> float:
        """Tells where the snapshots begin so that all of them are in the middle."""
        return LABEL + (style.TWO_COLUMNS - LABEL - BAR - self.columns * self.width) / 2

    @cached_property
    def labels(self) -> tuple[list[Label], list[Label]]:
        """Lists the labels above and left of the snapshots, each no longer than one of these."""
        path = self.path
        along, across = self.width - GAP, self.height - GAP
        of_kinds, of_loads = (along, across) if self.beside else (across, along)
        kinds = [(_wrapped(row.label, of_kinds), row.colour) for row in self.rows]
        loads = (f"{path.symbol} = {path.at(sample)}" for sample in path.shown)
        values = [(_wrapped(load, of_loads), style.INTACT) for load in loads]
        return (kinds, values) if self.beside else (values, kinds)

    @property
    def head(self) -> float:
        """Returns the room for the panel's title and the labels above the snapshots."""
        return _HEAD + self._further_lines(0)

    @property
    def total(self) -> float:
        """Returns the room for all snapshots below the head."""
        return self.lines * self.height + self._heads_until(self.bands - 1)

    def _heads_until(self, band: int) -> float:
        """Returns the room for the labels of all bands from the second to this one."""
        return sum(_BAND_HEAD + self._further_lines(k) for k in range(1, band + 1))

    def _further_lines(self, band: int) -> float:
        """Returns the room for all lines but one of the labels above a band."""
        above = self.labels[0][band * self.columns : (band + 1) * self.columns]
        return _LINE * max((text.count("\n") for text, _ in above), default=0)

    def at(self, row: int, load: int) -> tuple[int, int]:
        """Returns line and column of a snapshot."""
        band, column = divmod(row, self.columns)
        return (band * len(self.path.shown) + load, column) if self.beside else (row, load)

    def below(self, line: int) -> float:
        """Returns how far below the first line of snapshots another one begins, mm."""
        return line * self.height + self.heads(line)

    def heads(self, line: int) -> float:
        """Returns the room for the labels of bands between the first line and another one, mm."""
        return self._heads_until(line // (self.lines // self.bands))

    def omission(self, path: Abscissa) -> str:
        """Tells that not all samples of the path are shown that were to be, as HTML."""
        if self.path.shown == path.shown:
            return ""
        which = "last alone is" if len(self.path.shown) == 1 else "first and the last are"
        return f" Of the {len(path.shown)} instants of the snapshots the {which} shown, for room."


def _width(columns: int, lines: int, tallest: float, slim: float) -> float:
    """Returns the width of a snapshot, mm, so that so many fit beside and above one another."""
    across = style.TWO_COLUMNS - LABEL - BAR
    return min(across / columns, tallest / lines / slim, LARGEST * min(1.0, 1.0 / slim))


def _slenderness(lattice: Lattice) -> float:
    """Returns height over width of the snapshots of a lattice: one if these are nearly equal."""
    extent = np.ptp([site[1:] for site in lattice.sites()], axis=0) + lattice.spacing
    slim = float(np.clip(extent[1] / extent[0], _SLIMMEST, 1.0 / _SLIMMEST))
    return 1.0 if _NEARLY_SQUARE < slim < 1.0 / _NEARLY_SQUARE else slim


def _wrapped(text: str, room: float) -> str:
    """Breaks lines of a label between words, not in brackets, to be no longer than so many mm."""
    if "\n" not in text and _length(text, style.TEXT) <= room:
        return text
    lines: list[str] = []
    for line in text.split("\n"):
        lines.append("")
        for word in _GAPS.split(line):
            longer = f"{lines[-1]} {word}".strip()
            if lines[-1] and _length(longer, style.SMALL) > room:
                lines.append(word)
            else:
                lines[-1] = longer
    return "\n".join(lines)


def _size(text: str, room: float) -> float:
    """Chooses the size of a label: small if it has several lines, or is longer than so many mm."""
    fits = "\n" not in text and _length(text, style.TEXT) <= room
    return style.TEXT if fits else style.SMALL


@lru_cache(maxsize=1024)
def _length(text: str, size: float) -> float:
    """Measures a line of text in points, mm: by its outline, for which lines come again."""
    points = TextPath((0.0, 0.0), text, size=size).get_extents().width
    return float(points) * style.MM_PER_INCH / 72.0


Overlay = Callable[[Axes, SnapshotStructure, int], None]


def snapshots(
    figure: Figure,
    study: StudyResults,
    grid: SnapshotLayout,
    top: float,
    overlay: Overlay | None = None,
) -> None:
    """Draws all structures at all loads shown, from ``top`` (mm) on, an ``overlay`` on each."""
    shade, wide, tall = shade_of(study.problem, study.response), grid.width, grid.height
    samples = grid.path.shown
    margin = max(snapshot_margin(study.problem, row.part, samples, row.case) for row in grid.rows)
    for k, row in enumerate(grid.rows):
        for m, sample in enumerate(grid.path.shown):
            line, column = grid.at(k, m)
            left, below = grid.left + column * wide, grid.below(line)
            axes = style.place(figure, left, top + below, wide - GAP, tall - GAP)
            snapshot(axes, study.problem, row.part, sample, shade, row.case, margin)
            if overlay is not None:
                overlay(axes, row, sample)
    _labels(figure, grid, top, *grid.labels)
    end = grid.left + grid.columns * wide
    shade_bar(figure, shade, (end + 1.5, top, grid.total - GAP))


def _labels(
    figure: Figure, grid: SnapshotLayout, top: float, above: Sequence[Label], left: Sequence[Label]
) -> None:
    for k, (text, colour) in enumerate(above):
        band, column = divmod(k, grid.columns)
        x = grid.left + (column + 0.5) * grid.width - GAP / 2
        y = top + grid.below(band * (grid.lines // grid.bands)) - 0.8
        style.write(
            figure, x, y, text, ha="center", va="bottom", color=colour,
            fontsize=_size(text, grid.width - GAP), multialignment="center",
        )  # fmt: skip
    for k in range(grid.lines):
        text, colour = left[k % len(left)]
        y = top + (k + 0.5) * grid.height + grid.heads(k) - GAP / 2
        off = 0.5 if "\n" in text else 1.5
        size = _size(text, grid.height - GAP)
        style.write_upwards(figure, grid.left - off, y, text, color=colour, fontsize=size)


def snapshot_margin(
    problem: Problem, part: xr.Dataset, samples: Sequence[int], case: int = 0
) -> float:
    """Finds the room (mm) about a structure at rest in which it is at the samples, uncut."""
    structure = from_dataset(part, problem.lattice.spacing)
    motion = part["displacement"].isel(case=case, time=list(samples))
    frames = motion.transpose("time", "unit", "dof").values
    points = np.stack([deformed(structure, frame) for frame in frames])
    low, high = (find(structure.vertices, axis=(0, 1)) for find in (np.nanmin, np.nanmax))
    beyond = max(float(np.nanmax(points - high)), float(np.nanmax(low - points)))
    return MARGIN if beyond <= MARGIN else beyond + 1.0


def snapshot(
    axes: Axes,
    problem: Problem,
    part: xr.Dataset,
    sample: int,
    shade: UnitColouring,
    case: int = 0,
    margin: float = MARGIN,
) -> None:
    """Draws one structure at one sample of its path, true to scale, `margin` mm about it."""
    structure = from_dataset(part, problem.lattice.spacing)
    motion = part["displacement"].isel(case=case, time=sample).transpose("unit", "dof").values
    if not np.isfinite(motion).any():  # at rest it would look as if nothing had moved
        frame(axes, structure, margin)
        words = "not\nrecorded"
        axes.text(
            0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center",
            color=style.GREY, fontsize=style.SMALL,
        )  # fmt: skip
        return
    values = shade.values(motion)
    colours = shade.colours
    draw(axes, structure, motion, values=values, colour_map=colours, norm=shade.norm, margin=margin)


def shade_bar(figure: Figure, shade: UnitColouring, place: tuple[float, float, float]) -> None:
    """Draws the bar of the snapshots, in `place`: mm from the left and the top, and height."""
    bar = colour_bar(figure, shade.norm, shade.colours, place, shade.label).ax
    most = int(np.clip(place[-1] / 3.5, 2, 8))  # numbers of a low bar would overlap
    bar.yaxis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
    bar.yaxis.set_major_formatter(lambda value, _: typeset(f"{value:g}"))
    scale_wide_numbers(bar, WIDEST_OF_BAR)
