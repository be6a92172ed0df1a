"""A stroke font for ids, and where the id of a unit and its arrow go."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, Polygon, affinity

from pipeline.fabrication.parts import Floats, Strokes
from pipeline.problem.fabrication import Labels

_GLYPHS = {
    "0": "01 05 16 36 45 41 30 10 01,12 34",
    "1": "14 26 20,10 30",
    "2": "05 16 36 45 44 00 40",
    "3": "06 46 23 33 42 41 30 10 01",
    "4": "30 36 02 42",
    "5": "46 06 03 33 42 41 30 10 01",
    "6": "45 36 16 05 01 10 30 41 42 33 13 02",
    "7": "06 46 10",
    "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "01 10 30 41 45 36 16 05 04 13 33 44",
    "A": "00 04 26 44 40,02 42",
    "B": "00 06 36 45 44 33 03,33 42 41 30 00",
    "C": "45 36 16 05 01 10 30 41",
    "D": "00 06 26 44 42 20 00",
    "E": "46 06 00 40,03 33",
    "F": "46 06 00,03 33",
    "G": "45 36 16 05 01 10 30 41 43 23",
    "H": "00 06,40 46,03 43",
    "I": "10 30,16 36,20 26",
    "J": "01 10 30 41 46",
    "K": "00 06,46 02,13 40",
    "L": "06 00 40",
    "M": "00 06 23 46 40",
    "N": "00 06 40 46",
    "O": "01 05 16 36 45 41 30 10 01",
    "P": "00 06 36 45 44 33 03",
    "Q": "01 05 16 36 45 41 30 10 01,22 40",
    "R": "00 06 36 45 44 33 03,23 40",
    "S": "45 36 16 05 04 13 33 42 41 30 10 01",
    "T": "06 46,26 20",
    "U": "06 01 10 30 41 46",
    "V": "06 20 46",
    "W": "06 10 23 30 46",
    "X": "00 46,06 40",
    "Y": "06 23 46,23 20",
    "Z": "06 46 00 40",
    "a": "34 30,32 23 13 02 01 10 20 31",
    "b": "06 00,02 13 23 32 31 20 10 01",
    ".": "20 21",
    "-": "13 33",
}
"""Polylines of points (x, y) on a grid of 4 by 6; the zero is crossed."""

_WIDTH = 0.45  # of a letter over its height
_ADVANCE = 0.7  # from letter to letter
_STACK = 1.3  # from line to line, where letters stand below each other
LEAST_HEIGHT = 2.0  # mm
_MARGINS = (0.4, 0.05)  # mm, wanted and least, to the rim of the part
_OVERHANGS = (0.25, 0.5, 0.75)  # mm, as the last resort
_STEP = 0.35  # mm
_LEAST_ARROW = 0.8  # mm
_SPECK = 0.1  # mm; shorter pieces of a clipped stroke are left out
_RING = 0.3  # mm, radius
_ARROW = ("00 23 40", "20 23")  # on a grid of 4 by 3


class Placed(NamedTuple):
    """Strokes with the box that they fill.

    Attributes:
        strokes: as read from the top.
        mirrored: the same, to be read from below, seen from the top.
        box: their bounding box, turned with them.
    """

    strokes: Strokes
    mirrored: Strokes
    box: Polygon


def text(words: str, height: float, *, stacked: bool = False) -> Strokes:
    """Strokes of a line of text, or of letters below each other, centred at the origin.

    Raises:
        KeyError: there is no such letter.
    """
    step = np.array([0.0, -_STACK] if stacked else [_ADVANCE, 0.0])
    scale = np.array([_WIDTH / 4, 1 / 6])
    strokes = [
        (_points(line) * scale + index * step) * height
        for index, letter in enumerate(words)
        for line in _GLYPHS[letter].split(",")
    ]
    full = step * (len(words) - 1) * height
    middle = (np.array([_WIDTH, 1.0]) * height + full) / 2
    return tuple(stroke - middle for stroke in strokes)


def _points(line: str) -> Floats:
    return np.array([[float(digit) for digit in point] for point in line.split()])


def extent(words: str, height: float, *, stacked: bool = False) -> tuple[float, float]:
    """Width and height of a text."""
    more = len(words) - 1
    if stacked:
        return _WIDTH * height, (1 + more * _STACK) * height
    return (_WIDTH + more * _ADVANCE) * height, height


def turned(strokes: Strokes, angle: float, centre: tuple[float, float]) -> Strokes:
    """Strokes turned about the origin, then moved."""
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    return tuple(stroke @ turn + np.array(centre) for stroke in strokes)


def fitted(words: str, outline: Polygon, body: Polygon, wanted: Labels) -> Placed | None:
    """An id inside an outline, as large, as upright and as central as there is room for.

    Where slots leave no room even for the smallest letters, they cut through the letters; where
    the body leaves none, the letters lose a corner.

    Args:
        words: the id.
        outline: of the part, with slots.
        body: the same without slots.
        wanted: how large.

    Returns:
        None if it has no room even so.
    """
    for place in (outline, body, *(body.buffer(over) for over in _OVERHANGS)):
        for height, stacked, margin, angle in _attempts(place, wanted.height):
            width, tall = extent(words, height, stacked=stacked)
            pen = min(wanted.stroke, 0.15 * height)
            box = (width + pen + 2 * margin, tall + pen + 2 * margin)
            centre = _room_for(box, angle, place)
            if centre is not None:
                plain = text(words, height, stacked=stacked)
                mirrored = tuple(stroke * [-1.0, 1.0] for stroke in plain)
                return Placed(
                    _clipped(turned(plain, angle, centre), outline),
                    _clipped(turned(mirrored, angle, centre), outline),
                    _box(box, angle, centre),
                )
    return None


def mark(outline: Polygon, body: Polygon, taken: Polygon, wanted: Labels) -> Strokes:
    """An arrow to +y, near to the place that is taken; a small ring at the upper end if no room."""
    near = (taken.centroid.x, taken.centroid.y)
    for place in (outline.difference(taken), body.difference(taken)):
        for size in (0.5 * wanted.height, 0.4 * wanted.height, _LEAST_ARROW):
            pen = min(wanted.stroke, 0.4 * size)
            for margin in _MARGINS:
                box = (size + pen + 2 * margin, 0.75 * size + pen + 2 * margin)
                centre = _room_for(box, 0.0, place, near)
                if centre is not None:
                    scaled = tuple((_points(line) - [2.0, 1.5]) * size / 4 for line in _ARROW)
                    return _clipped(turned(scaled, 0.0, centre), outline)
    return (_ring(outline),)


def _ring(outline: Polygon) -> Floats:
    inner = outline.buffer(-_RING - _MARGINS[-1])
    points = shapely.get_coordinates(
        inner if not inner.is_empty else outline.representative_point()
    )
    turn = np.linspace(0.0, 2 * np.pi, 9)
    top = points[np.lexsort((points[:, 0], points[:, 1]))[-1]]
    return top + _RING * np.column_stack([np.cos(turn), np.sin(turn)])


def _clipped(strokes: Strokes, outline: Polygon) -> Strokes:
    """What of the strokes lies on the part."""
    inner = outline.buffer(-_MARGINS[-1])
    shapely.prepare(inner)
    kept: list[Floats] = []
    for stroke in strokes:
        line = LineString(stroke)
        if inner.contains(line):
            kept.append(stroke)
        else:
            pieces = shapely.get_parts(line.intersection(inner))
            kept += [np.asarray(piece.coords) for piece in pieces if piece.length > _SPECK]
    return tuple(kept)


def _attempts(outline: Polygon, largest: float) -> Iterator[tuple[float, bool, float, float]]:
    """Height, stacked or not, margin, angle; from the best to the last resort."""
    heights = np.unique(
        np.clip([largest, (largest + LEAST_HEIGHT) / 2, LEAST_HEIGHT], None, largest)
    )
    slope = _slope(outline)
    for height in heights[::-1]:
        for margin in _MARGINS:
            yield float(height), False, margin, 0.0
            yield float(height), False, margin, slope
            across = slope + np.pi / 2 if slope < 0 else slope - np.pi / 2
            yield float(height), True, margin, across
    for angle in np.deg2rad(np.arange(-90.0, 90.0, 10.0)):
        yield LEAST_HEIGHT, False, _MARGINS[-1], float(angle)
        yield LEAST_HEIGHT, True, _MARGINS[-1], float(angle)


def _slope(outline: Polygon) -> float:
    """Direction of the longest edge, between -90 and 90 deg."""
    points = np.asarray(outline.exterior.coords)
    edges = np.diff(points, axis=0)
    x, y = edges[np.argmax(np.round(np.linalg.norm(edges, axis=1), 6))]
    return float(np.arctan2(y, x) if x > 0 or (x == 0 and y > 0) else np.arctan2(-y, -x))


def _room_for(
    box: tuple[float, float],
    angle: float,
    outline: Polygon,
    near: tuple[float, float] | None = None,
) -> tuple[float, float] | None:
    """Centre of a box inside an outline, as near as can be to its centroid or to ``near``.

    The centre lies in each copy of the outline that is shifted by minus a point of the box's rim.
    """
    rim = np.asarray(_box(box, angle, (0.0, 0.0)).exterior.coords)
    rim = np.concatenate([rim[:-1], (rim[:-1] + rim[1:]) / 2])
    copies = [affinity.translate(outline, -x, -y) for x, y in rim]
    region = shapely.intersection_all(copies)
    if region.area == 0.0:
        return None
    target = outline.centroid if near is None else shapely.Point(near)
    nearest = shapely.get_coordinates(shapely.shortest_line(region, target))[0]
    x0, y0, x1, y1 = region.bounds
    x, y = np.meshgrid(np.arange(x0, x1, _STEP), np.arange(y0, y1, _STEP))
    grid = np.column_stack([x.ravel(), y.ravel()])
    distance = np.linalg.norm(grid - [target.x, target.y], axis=1)
    grid = grid[np.argsort(np.round(distance, 6), kind="stable")]
    centres = np.concatenate([nearest[None], grid[shapely.contains_xy(region, grid)]])
    boxes = shapely.polygons(centres[:, None, :] + rim[[0, 4, 1, 5, 2, 6, 3, 7]] * (1.0 - 1e-6))
    shapely.prepare(outline)
    fits = np.flatnonzero(shapely.contains(outline, boxes))
    if not len(fits):
        return None
    x, y = centres[fits[0]]
    return float(x), float(y)


def _box(size: tuple[float, float], angle: float, centre: tuple[float, float]) -> Polygon:
    width, height = size[0] / 2, size[1] / 2
    rim = np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    return Polygon(turned((rim,), angle, centre)[0])
