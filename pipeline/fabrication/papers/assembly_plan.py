"""Draws the specimen for its assembly, at true scale over as few pages as hold it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from pipeline.fabrication.papers.pdf_paper import BOLD, GREY, PALE, POINT, SIGNAL, Box, PdfDocument
from pipeline.fabrication.parts import BuiltSpecimen, Ligament, Unit, column_letters
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
_ID, _SMALLEST = 6.5, 3.0  # points
_ASPECT = 0.75  # a letter's width to its size, with some room
_NUMBER = 4.5
_RING = 2.5  # mm


@dataclass(frozen=True)
class Tile:
    """Holds one page's part of the drawing.

    Attributes:
        name: row letter from the top and column number, "B2".
        window: its part, in the drawing's coordinates.
        row, column: from the top left, from zero.
        of: rows and columns of pages.
    """

    name: str
    window: Box
    row: int
    column: int
    of: tuple[int, int]

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
        name = f"{unit.label}={unit.letter}" if unit.letter else unit.label
        x, y, size = _name_place(unit, name)
        place = np.array([x, y - 0.12 * size]) + origin
        self._sheet.text(place[0], place[1], name, size, BOLD, at="middle")
        for stroke in unit.mark:
            self._sheet.line(np.asarray(stroke) + origin, 0.25, SIGNAL)

    def _ligament(self, ligament: Ligament, origin: Floats) -> None:
        """Draws the shim from slot end to slot end, with its number between the units."""
        ends = (self._specimen.by_label[label] for label in ligament.labels)
        slots = [slot for unit in ends for slot in unit.slots if slot.ligament == ligament.number]
        if len(slots) != 2:
            return
        first, second = slots
        kind = self._kind[ligament.number]
        tone = TONES[kind % len(TONES)]
        path = np.array([first.end, first.mouth, second.mouth, second.end])
        self._sheet.line(path + origin, 0.3, tone)
        x, y = np.array(ligament.middle) + origin
        if ligament.number in self._worst:
            ring = np.asarray(shapely.Point(x, y).buffer(_RING).exterior.coords)
            self._sheet.line(ring, 0.4, SIGNAL)
        self._sheet.text(x + 0.4, y + 0.4, str(kind + 1), _NUMBER, colour=tone)

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


def _name_place(unit: Unit, name: str) -> tuple[float, float, float]:
    """Finds the middle of a unit, where it is widest, and the size of type that fits there."""
    circle = shapely.maximum_inscribed_circle(unit.outline, tolerance=0.05)
    (x, y), radius = circle.coords[0], float(circle.length)
    fitting = 2.0 * radius * POINT / (_ASPECT * len(name))
    return x, y, min(_ID, max(_SMALLEST, fitting))
