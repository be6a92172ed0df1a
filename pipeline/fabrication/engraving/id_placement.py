"""Places the id of a unit, and beside it the mark that tells how the unit stands."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Polygon, affinity
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.engraving.stroke_font import (
    ADVANCE,
    STACK,
    grid_points,
    text_extent,
    text_strokes,
    transformed,
)
from pipeline.fabrication.parts import Strokes
from pipeline.problem.sections import Labels
from sim.core import Floats

Box = tuple[float, float]
"""Width and height, mm."""

_LEAST_HEIGHT = 2.0  # mm
_MARGINS = (0.4, 0.05)  # preferred and least, to the rim of the part, mm
_LEGIBLE = 0.7  # share of the strokes that has to lie on the part
_OVERHANGS = (0.25, 0.5, 0.75)  # mm, as the last resort
_STEP, _FINE_STEP = 0.35, 0.2  # mm, of the grids of centres
_GRID = 1e-6  # mm
_ANGLES = np.deg2rad(np.arange(-90.0, 90.0, 10.0))  # tried where there is little room
_ASIDE = 0.7  # mm that letters may be off the line of the first one
_HAIR = 1e-6  # mm
_SPECK = 0.1  # mm; shorter pieces of a clipped stroke are left out
_MOST_ARROW, _LEAST_ARROW = 1.5, 0.8  # mm
_ARROW_KEPT = 0.9  # of an arrow that a slot cuts
_RING, _CLEAR = 0.3, 0.2  # mm, radius, and room to letters
_ARROW = ("00 23 40", "20 23")  # on a grid of 4 by 3


class PlacedId(NamedTuple):
    """Strokes of an id with the box that they fill."""

    strokes: Strokes  # as read from the top
    mirrored: Strokes  # the same, to be read from below, seen from the top
    box: BaseGeometry  # their bounding box, turned with them
    kept: float  # share of the strokes that lies on the part, on the side where it is less


def place_id(words: str, outline: Polygon, body: Polygon, settings: Labels) -> PlacedId | None:
    """Places an id inside an outline, as large, as upright and as central as there is room for.

    Where slots leave no room even for the smallest letters, they cut through the letters; where
    the body leaves none, the letters lose a corner.

    Args:
        words: the id.
        outline: of the part, with slots.
        body: the same without slots.
        settings: preferred size of the letters.

    Returns:
        None if it has no room even so, or could not be read.
    """
    uncut = next(_placements(words, outline, outline, settings), None)
    if uncut is not None:
        return uncut
    for place in (body, *(body.buffer(over) for over in _OVERHANGS)):
        cut = list(_placements(words, place, outline, settings))
        best = max(cut, key=lambda placed: round(placed.kept, 2), default=None)
        if best is not None and best.kept > _LEGIBLE:
            return best
    return None


def _placements(
    words: str, place: Polygon, outline: Polygon, settings: Labels
) -> Iterator[PlacedId]:
    """Yields an id as it fits into a place, from the best to the last resort."""
    for height, stacked, margin, angle in _attempts(place, settings.height):
        box = _framed(text_extent(words, height, stacked=stacked), height, margin, settings)
        centre = _free_centre(box, angle, place)
        if centre is not None:
            plain = text_strokes(words, height, stacked=stacked)
            mirrored = tuple(stroke * [-1.0, 1.0] for stroke in plain)
            top, bottom = (transformed(side, angle, centre) for side in (plain, mirrored))
            yield _placed(top, bottom, _box_at(box, angle, centre), outline)
    apart = _letter_by_letter(words, place, outline, settings)
    if apart is not None:
        yield apart


def _framed(size: Box, height: float, margin: float, settings: Labels) -> Box:
    """Adds the width of the strokes and a margin to the size of letters."""
    more = min(settings.stroke, 0.15 * height) + 2 * margin
    return size[0] + more, size[1] + more


def _placed(top: Strokes, bottom: Strokes, box: BaseGeometry, outline: Polygon) -> PlacedId:
    strokes, mirrored = _clipped(top, outline), _clipped(bottom, outline)
    kept = min(_total_length(strokes), _total_length(mirrored)) / _total_length(top)
    return PlacedId(strokes, mirrored, box, kept)


def _letter_by_letter(
    words: str, place: Polygon, outline: Polygon, settings: Labels
) -> PlacedId | None:
    """Places the smallest letters in a row or a stack, each where slots leave room for it."""
    box = _framed(text_extent(words[0], _LEAST_HEIGHT), _LEAST_HEIGHT, _MARGINS[-1], settings)
    for angle in (_slope(place), *_ANGLES):
        level = affinity.rotate(place, -angle, origin=(0.0, 0.0), use_radians=True)
        free = _centres(box, 0.0, level, _FINE_STEP, level.centroid)[1:]
        for stacked in (False, True):
            centres = _in_order(free, len(words), stacked=stacked)
            if centres is not None:
                return _apart(words, centres, float(angle), box, outline, stacked=stacked)
    return None


def _in_order(free: Floats, count: int, *, stacked: bool) -> Floats | None:
    """Chooses free centres (count, 2) in reading order, near to each other and to one line."""
    step = _LEAST_HEIGHT * (STACK if stacked else ADVANCE)
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
    words: str, centres: Floats, angle: float, box: Box, outline: Polygon, *, stacked: bool
) -> PlacedId:
    """Sets letters at their centres, before all are turned; from below they run backwards."""
    letters = [text_strokes(letter, _LEAST_HEIGHT) for letter in words]
    below = centres if stacked else centres[::-1]
    top = [stroke + at for at, one in zip(centres, letters, strict=True) for stroke in one]
    bottom = [
        stroke * [-1.0, 1.0] + at for at, one in zip(below, letters, strict=True) for stroke in one
    ]
    boxes = shapely.union_all([_box_at(box, 0.0, (float(x), float(y))) for x, y in centres])
    origin = (0.0, 0.0)
    turned = affinity.rotate(boxes, angle, origin=origin, use_radians=True)
    plain, mirrored = (transformed(tuple(side), angle, origin) for side in (top, bottom))
    return _placed(plain, mirrored, turned, outline)


def _total_length(strokes: Strokes) -> float:
    return sum(LineString(stroke).length for stroke in strokes)


def _clipped(strokes: Strokes, outline: Polygon) -> Strokes:
    """Clips strokes to a part less the least margin."""
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
    """Yields height, stacked or not, margin, angle; from the best to the last resort."""
    steps = [largest, (largest + _LEAST_HEIGHT) / 2, _LEAST_HEIGHT]
    slope = _slope(outline)
    across = slope + np.pi / 2 if slope < 0 else slope - np.pi / 2
    for height in np.unique(np.clip(steps, None, largest))[::-1]:
        for margin in _MARGINS:
            yield float(height), False, margin, 0.0
            yield float(height), False, margin, slope
            yield float(height), True, margin, across
    for angle in _ANGLES:
        yield _LEAST_HEIGHT, False, _MARGINS[-1], float(angle)
        yield _LEAST_HEIGHT, True, _MARGINS[-1], float(angle)


def _slope(outline: Polygon) -> float:
    """Measures the direction of the longest edge, between -90 and 90 deg, in rad."""
    edges = np.diff(np.asarray(outline.exterior.coords), axis=0)
    x, y = edges[np.argmax(np.round(np.linalg.norm(edges, axis=1), 6))]
    return float(np.arctan2(y, x) if x > 0 or (x == 0 and y > 0) else np.arctan2(-y, -x))


def _free_centre(
    box: Box, angle: float, outline: Polygon, near: shapely.Point | None = None
) -> tuple[float, float] | None:
    """Finds the centre of a box in an outline, nearest to its centroid or to ``near``."""
    target = outline.centroid if near is None else near
    rim = _rim(box, angle)
    region = _region(rim, outline)
    centres = _nearest(region, target)
    if not _fits(centres, rim, outline).any():
        centres = _grid(region, _STEP)
        centres = centres[_fits(centres, rim, outline)]
    if not len(centres):
        return None
    distance = np.linalg.norm(centres - [target.x, target.y], axis=1)
    x, y = centres[np.argmin(np.round(distance, 6))]
    return float(x), float(y)


def _centres(
    box: Box, angle: float, outline: Polygon, step: float, target: shapely.Point
) -> Floats:
    """Finds centres (n, 2) of boxes inside an outline: the nearest to a target, and on a grid."""
    rim = _rim(box, angle)
    region = _region(rim, outline)
    centres = np.concatenate([_nearest(region, target), _grid(region, step)])
    fits: Floats = centres[_fits(centres, rim, outline)]
    return fits


def _rim(box: Box, angle: float) -> Floats:
    """Lists the corners of a box about the origin and the middles of its sides (8, 2)."""
    corners = np.asarray(_box_at(box, angle, (0.0, 0.0)).exterior.coords)
    return np.concatenate([corners[:-1], (corners[:-1] + corners[1:]) / 2])


def _region(rim: Floats, outline: Polygon) -> BaseGeometry:
    """Covers where the centre of a box with a rim (8, 2) may lie inside an outline.

    It lies in each copy of the outline that is shifted by minus a point of the box's rim.
    """
    copies = [shapely.transform(outline, lambda at, by=by: at - by) for by in rim]
    if shapely.disjoint(copies[:2], copies[2:4]).any():  # of opposite corners
        return Polygon()
    try:
        region = shapely.intersection_all(copies)
    except shapely.GEOSException:  # it gives up where copies nearly coincide
        region = shapely.intersection_all(shapely.set_precision(copies, _GRID))
    return region if region.area > 0.0 else Polygon()


def _nearest(region: BaseGeometry, target: shapely.Point) -> Floats:
    """Finds the point (1, 2) of a region nearest to a target; none (0, 2) of an empty region."""
    return shapely.get_coordinates(shapely.shortest_line(region, target))[:1]


def _grid(region: BaseGeometry, step: float) -> Floats:
    """Lists the points (n, 2) of a grid that lie in a region."""
    if region.is_empty:
        return np.empty((0, 2))
    x0, y0, x1, y1 = region.bounds
    x, y = np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step))
    grid = np.column_stack([x.ravel(), y.ravel()])
    inside: Floats = grid[shapely.contains_xy(region, grid)]
    return inside


def _fits(centres: Floats, rim: Floats, outline: Polygon) -> NDArray[np.bool_]:
    """Tests which boxes with a rim (8, 2) about centres (n, 2) lie inside an outline (n,)."""
    boxes = shapely.polygons(centres[:, None, :] + rim[[0, 4, 1, 5, 2, 6, 3, 7]] * (1.0 - 1e-6))
    shapely.prepare(outline)
    return np.asarray(shapely.contains(outline, boxes))


def _box_at(size: Box, angle: float, centre: tuple[float, float]) -> Polygon:
    width, height = size[0] / 2, size[1] / 2
    rim = np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    return Polygon(transformed((rim,), angle, centre)[0])


def orientation_mark(
    outline: Polygon, body: Polygon, placed: PlacedId, settings: Labels
) -> Strokes:
    """Draws an arrow to +y near the place of the id; a small ring at the upper end if no room."""
    taken = placed.box
    for place in (outline.difference(taken), body.difference(taken)):
        for arrow in _arrows(place, taken.centroid, settings):
            kept = _clipped(arrow, outline)
            if _total_length(kept) > _ARROW_KEPT * _total_length(arrow):
                return kept
    return (_ring(outline, placed),)


def _arrows(place: BaseGeometry, near: shapely.Point, settings: Labels) -> Iterator[Strokes]:
    """Yields arrows that fit into a place, from the best to the last resort."""
    for size in (_MOST_ARROW, 0.8 * _MOST_ARROW, _LEAST_ARROW):
        pen = min(settings.stroke, 0.4 * size)
        for margin in _MARGINS:
            box = (size + pen + 2 * margin, 0.75 * size + pen + 2 * margin)
            centre = _free_centre(box, 0.0, place, near)
            if centre is not None:
                scaled = tuple((grid_points(line) - [2.0, 1.5]) * size / 4 for line in _ARROW)
                yield transformed(scaled, 0.0, centre)


def _ring(outline: Polygon, placed: PlacedId) -> Floats:
    """Draws a ring as far up as it clears the letters; across them if only there it is above."""
    inner = outline.buffer(-_RING - _MARGINS[-1])
    above, below = (
        shapely.multilinestrings([LineString(each) for each in side]).buffer(_RING + _CLEAR)
        for side in (placed.strokes, placed.mirrored)
    )
    rooms = (inner.difference(above.union(below)), inner.difference(above), inner)
    tops = [_top(room) for room in rooms if not room.is_empty]
    upper = [top for top in tops if top[1] > outline.centroid.y]
    top = [*upper, *tops[-1:], _top(outline.representative_point())][0]
    turn = np.linspace(0.0, 2 * np.pi, 9)
    return top + _RING * np.column_stack([np.cos(turn), np.sin(turn)])


def _top(room: BaseGeometry) -> Floats:
    """Finds the uppermost point (2,) of a region."""
    points = shapely.get_coordinates(room)
    return np.asarray(points[np.lexsort((points[:, 0], points[:, 1]))[-1]])
