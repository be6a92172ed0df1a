"""Draws the specimen for its assembly, at true scale over as few pages as hold it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from pipeline.fabrication.papers.label_places import Corners, name_box, name_places, number_places
from pipeline.fabrication.papers.pdf_paper import BOLD, GREY, PALE, POINT, SIGNAL, Box, PdfDocument
from pipeline.fabrication.parts import BuiltSpecimen, Ligament, Slot, Unit, column_letters
from sim.core import Floats

OVERLAP = 12.0
"""Width of the strip that two neighbouring pages share, mm."""
BORDER = 9.0
"""Room around the specimen for the names of rows and columns, mm."""

TONES = ("#6f3fa0", "#1d7f78", "#c25e00", "#17427f", "#a3195b", "#4b7a1c", "#7a3b00", "#3b6b8f")
"""Colours of the shims, by length; over again where there are more lengths."""

WORST = 10
"""Number of the shims, bent most before any load, that are marked."""

_CROSS = 3.0
_NUMBER, _DIGIT = 7.5, (0.556, 0.71)  # points; width and height of a digit to its size
_AROUND = 0.25  # mm around a number
_FAR = 3.2  # mm from its shim, beyond which a line leads to it
_RING = 2.5  # mm


@dataclass(frozen=True)
class Tile:
    """Holds one page's part of the drawing."""

    name: str  # row letter from the top and column number, "B2"
    window: Box  # its part, in the drawing's coordinates
    row: int  # from the top left, from zero
    column: int  # likewise
    of: tuple[int, int]  # rows and columns of pages

    def joints(self) -> Iterator[tuple[str, float]]:
        """Yields the middle lines of the strips shared with other pages: ("x" or "y", position)."""
        left, low, width, height = self.window
        half = OVERLAP / 2
        if self.column > 0:
            yield "x", left + half
        if self.column < self.of[1] - 1:
            yield "x", left + width - half
        if self.row > 0:
            yield "y", low + height - half
        if self.row < self.of[0] - 1:
            yield "y", low + half


def tiles(box: Box, page: tuple[float, float]) -> list[Tile]:
    """Covers `box` with equal windows, no larger than `page`, row by row from the top left."""
    left, low, width, height = box
    rows, tall = _split(height, page[1])
    columns, wide = _split(width, page[0])
    return [
        Tile(
            f"{chr(ord('A') + row)}{column + 1}",
            (
                left + column * (wide - OVERLAP),
                low + (rows - 1 - row) * (tall - OVERLAP),
                wide,
                tall,
            ),
            row,
            column,
            (rows, columns),
        )
        for row in range(rows)
        for column in range(columns)
    ]


def _split(length: float, most: float) -> tuple[int, float]:
    """Counts the windows along a length, and measures each."""
    count = max(1, math.ceil((length - OVERLAP) / (most - OVERLAP)))
    return count, (length + (count - 1) * OVERLAP) / count


class AssemblyPlan:
    """Draws one specimen in its own frame on the pages of a document."""

    def __init__(self, specimen: BuiltSpecimen, sheet: PdfDocument) -> None:
        self._specimen, self._sheet = specimen, sheet
        self._kind = {
            ligament: number
            for number, shim in enumerate(specimen.shims)
            for ligament in shim.ligaments
        }
        self._worst = {ligament.number for ligament in specimen.bent[:WORST]}
        self._paths = _shim_paths(specimen)
        self._names = self._place_names()
        self._numbers = self._place_numbers()

    def _place_names(self) -> dict[str, tuple[float, float, float]]:
        """Finds the middles of the units' ids and their sizes, clear of shims and arrows."""
        units = self._specimen.units
        outlines, names = [unit.outline for unit in units], [_name(unit) for unit in units]
        places = name_places(outlines, names, [*self._paths.values()], [*_arrow_boxes(units)])
        return dict(zip((unit.label for unit in units), places, strict=True))

    def _place_numbers(self) -> dict[int, tuple[float, float]]:
        """Finds the middles of the shims' numbers, clear of ids and arrows."""
        ligaments = [one for one in self._specimen.ligaments if one.number in self._paths]
        middles = {one.number: np.array(one.middle) for one in ligaments}
        sizes = {number: _number_size(self._number(number)) for number in middles}
        units = self._specimen.units
        taken = [name_box(_name(unit), self._names[unit.label]) for unit in units]
        taken += _arrow_boxes(units)
        return number_places(middles, sizes, self._paths, taken)

    def _number(self, ligament: int) -> str:
        return str(self._kind[ligament] + 1)

    @property
    def box(self) -> Box:
        """The specimen and the names around it."""
        shapes = [unit.design for unit in self._specimen.units]
        left, low, right, high = shapely.total_bounds(shapes).tolist()
        width, height = right - left + 2 * BORDER, high - low + 2 * BORDER
        return left - BORDER, low - BORDER, width, height

    def draw(self, tile: Tile, place: Box) -> None:
        """Draws one page's part, its lower left corner at that of `place`."""
        origin = np.array(place[:2]) - tile.window[:2]
        seen = shapely.box(*tile.window[:2], *(np.array(tile.window[:2]) + tile.window[2:]))
        with self._sheet.window((*place[:2], *tile.window[2:])):
            for unit in self._specimen.units:
                if seen.intersects(unit.outline):
                    self._unit(unit, origin)
            for ligament in self._specimen.ligaments:
                self._ligament(ligament, origin)
            for ligament in self._specimen.ligaments:
                self._shim_number(ligament, origin)
            if self._specimen.in_rows:
                self._headings(origin)
        self._joints(tile, origin)

    def sketch(self, pages: Sequence[Tile], corner: tuple[float, float], scale: float) -> None:
        """Draws all units in small from a lower left corner, and over them the pages' frames."""
        low = np.array(self.box[:2])
        for unit in self._specimen.units:
            points = np.asarray(unit.outline.exterior.coords)[:-1]
            self._sheet.polygon((points - low) * scale + corner, PALE, 0.05)
        for tile in pages:
            x, y, width, height = tile.window
            frame = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]])
            points = (np.add(frame, [x, y]) - low) * scale + corner
            self._sheet.line(points, 0.25, SIGNAL)
            middle = points[:4].mean(axis=0)
            self._sheet.text(middle[0], middle[1] - 3.0, tile.name, 24, BOLD, SIGNAL, "middle")

    def _unit(self, unit: Unit, origin: Floats) -> None:
        """Draws outline, id and arrow of a unit; those in fixtures are tinted."""
        held = unit.label in {*self._specimen.clamped, *self._specimen.driven}
        fill = "#dccdee" if held else PALE
        self._sheet.polygon(np.asarray(unit.outline.exterior.coords)[:-1] + origin, fill)
        x, y, size = self._names[unit.label]
        place = np.array([x, y - 0.12 * size]) + origin
        self._sheet.text(place[0], place[1], _name(unit), size, BOLD, at="middle")
        for stroke in unit.mark:
            self._sheet.line(np.asarray(stroke) + origin, 0.25, SIGNAL)

    def _ligament(self, ligament: Ligament, origin: Floats) -> None:
        """Draws the shim from slot end to slot end, with a ring if it is one of the worst."""
        if ligament.number not in self._paths:
            return
        self._sheet.line(self._paths[ligament.number] + origin, 0.3, self._tone(ligament))
        if ligament.number in self._worst:
            spot = shapely.Point(np.array(ligament.middle) + origin)
            self._sheet.line(np.asarray(spot.buffer(_RING).exterior.coords), 0.4, SIGNAL)

    def _tone(self, ligament: Ligament) -> str:
        return TONES[self._kind[ligament.number] % len(TONES)]

    def _shim_number(self, ligament: Ligament, origin: Floats) -> None:
        """Writes the number of a shim on white, and leads a line to it from farther away."""
        if ligament.number not in self._numbers:
            return
        middle, spot = np.array(ligament.middle), np.array(self._numbers[ligament.number])
        words, tone = self._number(ligament.number), self._tone(ligament)
        if np.linalg.norm(spot - middle) > _FAR:
            self._sheet.line(np.array([middle, spot]) + origin, 0.12, tone)
        half = np.array(_number_size(words)) / 2
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
        self._sheet.polygon(spot + corners + origin, width=0.0)
        x, y = spot + origin
        low = y - _DIGIT[1] * _NUMBER / POINT / 2
        self._sheet.text(x, low, words, _NUMBER, colour=tone, at="middle")

    def _headings(self, origin: Floats) -> None:
        """Writes letters of the columns below and above, numbers of the rows left and right."""
        left, low, width, height = self.box
        columns: dict[int, list[Unit]] = {}
        rows: dict[int, list[Unit]] = {}
        for unit in self._specimen.units:
            columns.setdefault(unit.column, []).append(unit)
            rows.setdefault(unit.row, []).append(unit)
        for column, units in columns.items():
            for nearest, y in ((min, low + 2.0), (max, low + height - 5.0)):
                x = nearest(units, key=lambda unit: unit.row).design.centroid.x
                self._heading(np.add(origin, [x, y]), column_letters(column))
        for row, units in rows.items():
            for nearest, x in ((min, left + 3.5), (max, left + width - 3.5)):
                y = nearest(units, key=lambda unit: unit.column).design.centroid.y - 1.2
                self._heading(np.add(origin, [x, y]), str(row + 1))

    def _heading(self, place: Floats, name: str) -> None:
        self._sheet.text(place[0], place[1], name, 10, BOLD, GREY, "middle")

    def _joints(self, tile: Tile, origin: Floats) -> None:
        """Marks where pages meet: a dashed line to cut along, and crosses that have to coincide."""
        left, low, width, height = tile.window
        for axis, position in tile.joints():
            order = [0, 1] if axis == "x" else [1, 0]
            start, length = (low, height) if axis == "x" else (left, width)
            points = np.array([[position, start], [position, start + length]])[:, order]
            self._sheet.dashed(points + origin)
            for part in (0.25, 0.75):
                along = start + OVERLAP + part * (length - 2 * OVERLAP)
                centre = np.array([position, along])[order] + origin
                for step in (np.array([_CROSS, 0.0]), np.array([0.0, _CROSS])):
                    self._sheet.line(np.array([centre - step, centre + step]), 0.15)


def _shim_paths(specimen: BuiltSpecimen) -> dict[int, Floats]:
    """Traces shims from slot end to slot end: (4, 2) by id."""
    slots: dict[int, list[Slot]] = {}
    for unit in specimen.units:
        for slot in unit.slots:
            slots.setdefault(slot.ligament, []).append(slot)
    return {
        number: np.array([pair[0].end, pair[0].mouth, pair[1].mouth, pair[1].end])
        for number, pair in slots.items()
        if len(pair) == 2
    }


def _number_size(words: str) -> tuple[float, float]:
    """Measures the box of a number, mm."""
    wide, high = _DIGIT
    size = _NUMBER / POINT
    return wide * size * len(words) + 2 * _AROUND, high * size + 2 * _AROUND


def _name(unit: Unit) -> str:
    return f"{unit.label}={unit.letter}" if unit.letter else unit.label


def _arrow_boxes(units: Sequence[Unit]) -> Iterator[Corners]:
    """Yields the boxes of the arrows on the plan."""
    for unit in units:
        if unit.mark:
            yield shapely.MultiLineString(list(unit.mark)).bounds
