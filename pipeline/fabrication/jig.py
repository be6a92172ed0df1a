"""The assembly jig: plates with pockets that hold the units at their places."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import shapely
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.fixtures import corridors, printable
from pipeline.fabrication.flat import cuts
from pipeline.fabrication.font import extent, text, turned
from pipeline.fabrication.parts import Specimen
from pipeline.fabrication.solids import MERGED, Layer, Solid, flat, merged, pen
from pipeline.problem.fabrication import Fabrication

_RIM, _BASE, _WALL = 6.0, 2.4, 4.0  # mm
_PEN = 0.5  # mm
_LETTER = 4.0  # mm


def jig(specimen: Specimen, wanted: Fabrication, spacing: float) -> Iterator[Solid]:
    """Plates with a pocket for each unit at its place, its id on the floor of the pocket."""
    outlines = [unit.outline for unit in specimen.units]
    x0, y0, x1, y1 = (float(value) for value in shapely.total_bounds(outlines))
    pockets = shapely.union_all(
        shapely.buffer(outlines, wanted.fixture.clearance, join_style="mitre", mitre_limit=2.0)
    )
    taken = pockets.union(corridors(specimen))
    room = [side - 2 * wanted.print.margin for side in wanted.print.bed]
    columns = cuts(x0 - _RIM, x1 + _RIM, spacing, room[0])
    rows = cuts(y0 - _RIM, y1 + _RIM, spacing, room[1])
    written = pen(
        tuple(stroke for unit in specimen.units for stroke in unit.lettering + unit.mark), _PEN
    )
    number = 0
    for low, high in pairwise(rows):
        for left, right in pairwise(columns):
            number += 1
            yield _plate(number, box(left, low, right, high), taken, written, wanted)


def _plate(
    number: int, tile: Polygon, taken: BaseGeometry, written: BaseGeometry, wanted: Fabrication
) -> Solid:
    walls = tile.difference(taken)
    walls = shapely.set_precision(printable(walls), 1e-3)
    name = f"JIG{number}"
    width, height = extent(name, _LETTER)
    left, low, _, _ = tile.bounds
    title = turned(text(name, _LETTER), 0.0, (left + width / 2 + 1.5, low + height / 2 + 1.0))
    sunk = shapely.union_all([written, pen(title, _PEN)]).intersection(tile.buffer(-0.5))
    letters = shapely.set_precision(sunk.difference(walls.buffer(2 * MERGED)), 1e-3)
    floor = tile.difference(merged(letters))
    deep = _BASE - wanted.labels.depth
    return Solid(
        name,
        (
            Layer(tile, 0.0, deep),
            Layer(flat(floor), deep, _BASE),
            Layer(flat(walls), _BASE, _BASE + _WALL),
        ),
    )
