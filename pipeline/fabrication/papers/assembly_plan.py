"""Draws the specimen for its assembly: units with ids and arrows, shims, rows and columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from pipeline.fabrication.papers.page_tiles import OVERLAP, Tile
from pipeline.fabrication.papers.pdf_paper import (
    BOLD,
    GREY,
    INK,
    PALE,
    POINT,
    SIGNAL,
    Box,
    PdfDocument,
)
from pipeline.fabrication.parts import BuiltSpecimen, Shim, Unit, column_letters
from sim.core import Floats

BORDER = 9.0
"""Room around the specimen for the names of rows and columns, mm."""

TONES = ("#6f3fa0", "#1d7f78", "#c25e00", "#17427f", "#a3195b", "#4b7a1c", "#7a3b00", "#3b6b8f")
"""Colours of the shims, by length; over again where there are more lengths."""

_CROSS = 3.0
_ID, _SMALLEST = 6.5, 3.0  # points
_ASPECT = 0.75  # a letter's width to its size, with some room
_NUMBER = 4.5


class AssemblyPlan:
    """The drawing of one specimen, in its own frame.

    Args:
        specimen: what is built.
        sheet: where it is drawn.
    """

    def __init__(self, specimen: BuiltSpecimen, sheet: PdfDocument) -> None:
        self._specimen, self._sheet = specimen, sheet
        self._shim = {
            ligament: (number, shim)
            for number, shim in enumerate(specimen.shims, 1)
            for ligament in shim.ligaments
        }
        self._at = {unit.label: unit for unit in specimen.units}

    @property
    def box(self) -> Box:
        """The specimen and the names around it."""
        shapes = [unit.design for unit in self._specimen.units]
        left, low, right, high = shapely.total_bounds(shapes)
        return (
            float(left) - BORDER,
            float(low) - BORDER,
            float(right - left) + 2 * BORDER,
            float(high - low) + 2 * BORDER,
        )

    def draw(self, tile: Tile, place: Box) -> None:
        """One page's part, its lower left corner at that of `place`."""
        origin = np.array(place[:2]) - tile.window[:2]
        seen = shapely.box(*tile.window[:2], *(np.array(tile.window[:2]) + tile.window[2:]))
        with self._sheet.window((*place[:2], *tile.window[2:])):
            for unit in self._specimen.units:
                if seen.intersects(unit.outline):
                    self._unit(unit, origin)
            for ligament in self._specimen.ligaments:
                self._ligament(ligament.number, ligament.labels, origin)
            self._headings(origin)
        self._joints(tile, origin)

    def sketch(self, pages: Sequence[Tile], corner: tuple[float, float], scale: float) -> None:
        """All units in small, and over them the pages that show them.

        Args:
            pages: of the plan.
            corner: where the lower left corner of the plan goes on the page.
            scale: how small.
        """
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
        """Outline, id and arrow of a unit; those in fixtures are tinted."""
        held = unit.label in {*self._specimen.clamped, *self._specimen.driven}
        fill = "#dccdee" if held else PALE
        self._sheet.polygon(np.asarray(unit.outline.exterior.coords)[:-1] + origin, fill)
        x, y, size = _name_place(unit)
        words = np.array([x, y - 0.12 * size]) + origin
        self._sheet.text(words[0], words[1], _name(unit), size, BOLD, at="middle")
        for stroke in unit.mark:
            self._sheet.line(np.asarray(stroke) + origin, 0.25, SIGNAL)

    def _ligament(self, number: int, ends: tuple[str, str], origin: Floats) -> None:
        """The shim as a line from slot end to slot end, with its number between the units."""
        found = [
            slot for label in ends for slot in self._at[label].slots if slot.ligament == number
        ]
        if len(found) != 2:
            return
        first, second = found
        place, _ = self._shim[number]
        tone = TONES[(place - 1) % len(TONES)]
        path = np.array([first.end, first.mouth, second.mouth, second.end])
        self._sheet.line(path + origin, 0.3, tone)
        x, y = (first.mouth + second.mouth) / 2 + origin
        self._sheet.text(x + 0.4, y + 0.4, str(place), _NUMBER, colour=tone)

    def _headings(self, origin: Floats) -> None:
        """Letters of the columns below and above, numbers of the rows left and right."""
        left, low, width, height = self.box
        columns: dict[int, list[Unit]] = {}
        rows: dict[int, list[Unit]] = {}
        for unit in self._specimen.units:
            columns.setdefault(unit.column, []).append(unit)
            rows.setdefault(unit.row, []).append(unit)
        for column, units in columns.items():
            name = column_letters(column)
            for nearest, y in ((min, low + 2.0), (max, low + height - 5.0)):
                x = nearest(units, key=_row).design.centroid.x
                self._heading(np.add(origin, [x, y]), name)
        for row, units in rows.items():
            for nearest, x in ((min, left + 3.5), (max, left + width - 3.5)):
                y = nearest(units, key=_column).design.centroid.y - 1.2
                self._heading(np.add(origin, [x, y]), str(row + 1))

    def _heading(self, place: Floats, name: str) -> None:
        x, y = place
        self._sheet.text(x, y, name, 10, BOLD, GREY, "middle")

    def _joints(self, tile: Tile, origin: Floats) -> None:
        """Where pages meet: a dashed line to cut along, and crosses that have to coincide."""
        left, low, width, height = tile.window
        for axis, position in tile.joints():
            across = axis == "x"
            reach = (low, height) if across else (left, width)
            ends = np.array([reach[0], reach[0] + reach[1]])
            fixed = np.full(2, position)
            points = np.column_stack([fixed, ends] if across else [ends, fixed])
            self._sheet.dashed(points + origin)
            for part in (0.25, 0.75):
                along = ends[0] + OVERLAP + part * (reach[1] - 2 * OVERLAP)
                centre = np.array([position, along] if across else [along, position]) + origin
                self._cross(centre)

    def _cross(self, centre: Floats) -> None:
        for step in (np.array([_CROSS, 0.0]), np.array([0.0, _CROSS])):
            self._sheet.line(np.array([centre - step, centre + step]), 0.15, INK)


def _name_place(unit: Unit) -> tuple[float, float, float]:
    """Middle of the name of a unit, where it is widest, and the size of type that fits there."""
    circle = shapely.maximum_inscribed_circle(unit.outline, tolerance=0.05)
    (x, y), radius = circle.coords[0], float(circle.length)
    fitting = 2.0 * radius * POINT / (_ASPECT * len(_name(unit)))
    return x, y, min(_ID, max(_SMALLEST, fitting))


def _name(unit: Unit) -> str:
    """The id of a unit, and the letter that it carries instead if it does."""
    return f"{unit.label}={unit.letter}" if unit.letter else unit.label


def _row(unit: Unit) -> int:
    return unit.row


def _column(unit: Unit) -> int:
    return unit.column


def legend(shims: tuple[Shim, ...]) -> list[tuple[str, str, str]]:
    """Number on the plan, id and colour of each kind of shim."""
    return [
        (str(number), shim.id, TONES[(number - 1) % len(TONES)])
        for number, shim in enumerate(shims, 1)
    ]
