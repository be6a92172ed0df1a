"""Where the id of a unit goes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, Polygon, affinity

from pipeline.fabrication.engraving.free_boxes import box_at, room_for, spots
from pipeline.fabrication.engraving.stroke_font import ADVANCE, STACK, extent, text, turned
from pipeline.fabrication.parts import Strokes
from pipeline.problem.sections import Labels
from sim.core import Floats

LEAST_HEIGHT = 2.0  # mm
MARGINS = (0.4, 0.05)
"""Wanted and least, to the rim of the part, mm."""

_LEGIBLE = 0.7  # of the strokes
_OVERHANGS = (0.25, 0.5, 0.75)  # mm, as the last resort
_FINE_STEP = 0.2  # mm
_ANGLES = np.deg2rad(np.arange(-90.0, 90.0, 10.0))  # tried where there is little room
_ASIDE = 0.7  # mm that letters may be off the line of the first one
_HAIR = 1e-6  # mm
_SPECK = 0.1  # mm; shorter pieces of a clipped stroke are left out


class Placed(NamedTuple):
    """Strokes with the box that they fill.

    Attributes:
        strokes: as read from the top.
        mirrored: the same, to be read from below, seen from the top.
        box: their bounding box, turned with them.
        kept: share of the strokes that lies on the part, on the side where it is less.
    """

    strokes: Strokes
    mirrored: Strokes
    box: shapely.Geometry
    kept: float


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
        None if it has no room even so, or could not be read.
    """
    whole = next(_placements(words, outline, outline, wanted), None)
    if whole is not None:
        return whole
    for place in (body, *(body.buffer(over) for over in _OVERHANGS)):
        cut = list(_placements(words, place, outline, wanted))
        best = max(cut, key=lambda placed: round(placed.kept, 2), default=None)
        if best is not None and best.kept > _LEGIBLE:
            return best
    return None


def _placements(words: str, place: Polygon, outline: Polygon, wanted: Labels) -> Iterator[Placed]:
    """An id as it fits into a place, from the best to the last resort."""
    for height, stacked, margin, angle in _attempts(place, wanted.height):
        box = _framed(extent(words, height, stacked=stacked), height, margin, wanted)
        centre = room_for(box, angle, place)
        if centre is not None:
            plain = text(words, height, stacked=stacked)
            mirrored = tuple(stroke * [-1.0, 1.0] for stroke in plain)
            top, bottom = turned(plain, angle, centre), turned(mirrored, angle, centre)
            yield _placed(top, bottom, box_at(box, angle, centre), outline)
    apart = _letter_by_letter(words, place, outline, wanted)
    if apart is not None:
        yield apart


def _framed(
    size: tuple[float, float], height: float, margin: float, wanted: Labels
) -> tuple[float, float]:
    """Size of letters with the width of their strokes and a margin."""
    more = min(wanted.stroke, 0.15 * height) + 2 * margin
    return size[0] + more, size[1] + more


def _placed(top: Strokes, bottom: Strokes, box: shapely.Geometry, outline: Polygon) -> Placed:
    strokes, mirrored = clipped(top, outline), clipped(bottom, outline)
    kept = min(total_length(strokes), total_length(mirrored)) / total_length(top)
    return Placed(strokes, mirrored, box, kept)


def _letter_by_letter(
    words: str, place: Polygon, outline: Polygon, wanted: Labels
) -> Placed | None:
    """Smallest letters on a line or below each other, each where slots leave room for it."""
    size = extent(words[0], LEAST_HEIGHT)
    box = _framed(size, LEAST_HEIGHT, MARGINS[-1], wanted)
    for angle in (_slope(place), *_ANGLES):
        level = affinity.rotate(place, -angle, origin=(0.0, 0.0), use_radians=True)
        free = spots(box, 0.0, level, _FINE_STEP, level.centroid)[1:]
        for stacked in (False, True):
            centres = _in_order(free, len(words), stacked=stacked)
            if centres is not None:
                return _apart(words, centres, float(angle), box, outline, stacked=stacked)
    return None


def _in_order(free: Floats, count: int, *, stacked: bool) -> Floats | None:
    """Centres (count, 2) in reading order, as near to each other and to one line as there is room.

    Args:
        free: (n, 2) possible centres.
        count: of letters.
        stacked: below each other.
    """
    step = LEAST_HEIGHT * (STACK if stacked else ADVANCE)
    level = free[:, ::-1] * [-1.0, 1.0] if stacked else free  # along, across
    best, least = None, np.inf
    for first in range(len(level)):
        taken = [first]
        while len(taken) < count:
            ahead, aside = (level - level[taken[-1]]).T
            cost = np.where(ahead >= step - _HAIR, ahead + 2.0 * np.abs(aside), np.inf)
            cost[np.abs(level[:, 1] - level[first, 1]) > _ASIDE] = np.inf
            taken.append(int(np.argmin(np.round(cost, 6))))
            if not np.isfinite(cost[taken[-1]]):
                break
        else:
            reach = np.ptp(level[taken, 0]) + 2.0 * np.ptp(level[taken, 1])
            if reach < least - _HAIR:
                best, least = free[taken], reach
    return best


def _apart(
    words: str,
    centres: Floats,
    angle: float,
    box: tuple[float, float],
    outline: Polygon,
    *,
    stacked: bool,
) -> Placed:
    """Letters at their centres, before all are turned; from below they are read backwards."""
    letters = [text(letter, LEAST_HEIGHT) for letter in words]
    below = centres if stacked else centres[::-1]
    top = [stroke + at for at, one in zip(centres, letters, strict=True) for stroke in one]
    bottom = [
        stroke * [-1.0, 1.0] + at for at, one in zip(below, letters, strict=True) for stroke in one
    ]
    boxes = shapely.union_all([box_at(box, 0.0, (float(x), float(y))) for x, y in centres])
    origin = (0.0, 0.0)
    return _placed(
        turned(tuple(top), angle, origin),
        turned(tuple(bottom), angle, origin),
        affinity.rotate(boxes, angle, origin=origin, use_radians=True),
        outline,
    )


def total_length(strokes: Strokes) -> float:
    """Of strokes, mm."""
    return sum(LineString(stroke).length for stroke in strokes)


def clipped(strokes: Strokes, outline: Polygon) -> Strokes:
    """What of the strokes lies on the part."""
    inner = outline.buffer(-MARGINS[-1])
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
        for margin in MARGINS:
            yield float(height), False, margin, 0.0
            yield float(height), False, margin, slope
            across = slope + np.pi / 2 if slope < 0 else slope - np.pi / 2
            yield float(height), True, margin, across
    for angle in _ANGLES:
        yield LEAST_HEIGHT, False, MARGINS[-1], float(angle)
        yield LEAST_HEIGHT, True, MARGINS[-1], float(angle)


def _slope(outline: Polygon) -> float:
    """Direction of the longest edge, between -90 and 90 deg."""
    points = np.asarray(outline.exterior.coords)
    edges = np.diff(points, axis=0)
    x, y = edges[np.argmax(np.round(np.linalg.norm(edges, axis=1), 6))]
    return float(np.arctan2(y, x) if x > 0 or (x == 0 and y > 0) else np.arctan2(-y, -x))
