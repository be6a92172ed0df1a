"""Cuts the outline of a unit: corners rounded, slots cut, thin tips taken off."""

from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.parts import Slot
from pipeline.problem.sections import Fabrication
from sim.core import Floats

GRID = 1e-5  # mm; coordinates are rounded to it
_BACK = 3.0  # slot widths by which cuts begin outside of the vertex
_SHORT = 1e-4  # mm; shorter edges are left out
_ROUND = 12  # segments per quarter circle


def filleted(polygon: Polygon, radius: float) -> Polygon:
    """Rounds the convex corners of a polygon; nothing is left of one that is narrower than they."""
    if radius == 0.0:
        return polygon
    inner = polygon.buffer(-radius, join_style="mitre", mitre_limit=100.0)
    return inner if inner.is_empty else _largest(inner.buffer(radius, quad_segs=_ROUND))


def room_to_grow(
    polygon: Polygon, neighbours: Sequence[Polygon], growth: float, settings: Fabrication
) -> Polygon:
    """Bounds the growth of a unit beside its slots by the least gap to its neighbours."""
    grown = polygon.buffer(growth, quad_segs=4)
    taken = shapely.union_all(
        [
            other.buffer(settings.minimum_gap + GRID, join_style="mitre", mitre_limit=100.0)
            for other in neighbours
            if other.distance(grown) < settings.minimum_gap + GRID
        ]
    )
    return _largest(grown.difference(taken).union(polygon))


def lugs(polygon: Polygon, room: Polygon, slots: Iterable[Slot], settings: Fabrication) -> Polygon:
    """Thickens a polygon along slots whose inner ends have too thin walls in it."""
    body = polygon
    for slot in slots:
        cap = _across(slot)
        if (
            not polygon.contains(cap)
            or cap.distance(polygon.exterior) < settings.minimum_wall - GRID
        ):
            side = slot.width / 2 + settings.minimum_wall
            lug = _rectangle(slot, 0.0, slot.depth + settings.minimum_wall, -side, side)
            body = body.union(lug.intersection(room))
    return _largest(body) if body is not polygon else polygon


def cut(
    body: Polygon,
    slots: Sequence[Slot],
    truncated: Sequence[tuple[float, float]],
    settings: Fabrication,
) -> Polygon:
    """Cuts the slots into a body, and the tips beside their mouths back.

    In front of its mouth a cut leaves the walls around the inner ends of other slots alone.

    Args:
        body: the unit without slots.
        slots: to be cut.
        truncated: how far the tip on the right and on the left of each slot is cut back.
        settings: widths of tips and walls.
    """
    held = {slot.vertex: _across(slot).buffer(settings.minimum_wall) for slot in slots}
    waste: list[BaseGeometry] = []
    for slot, lengths in zip(slots, truncated, strict=True):
        walls = [area for vertex, area in held.items() if vertex != slot.vertex]
        kept = shapely.intersection(_front(slot), shapely.union_all(walls))
        waste += [_channel(slot).difference(kept), *_tips(slot, lengths, settings)]
    # On a grid: in full precision GEOS's union may drop a piece whose edge touches another's.
    made = _largest(body.difference(shapely.union_all(waste, grid_size=GRID)))
    return _largest(shapely.set_precision(made.simplify(_SHORT), GRID))


def wall(made: Polygon, slot: Slot) -> float:
    """Measures the thinnest wall around the inner end of a slot in a cut outline, mm."""
    rest = made.exterior.difference(_channel(slot).buffer(_SHORT * 10))
    return float(_across(slot).distance(rest))


def _across(slot: Slot) -> LineString:
    side = slot.width / 2 * _left(slot)
    return LineString([slot.end - side, slot.end + side])


def _left(slot: Slot) -> Floats:
    return np.array([-slot.direction[1], slot.direction[0]])


def _rectangle(slot: Slot, start: float, stop: float, right: float, left: float) -> Polygon:
    """Draws a rectangle in the slot's own axes (along it, to its left)."""
    along, across = slot.direction, _left(slot)
    corners = [(start, right), (stop, right), (stop, left), (start, left)]
    return Polygon([slot.mouth + s * along + t * across for s, t in corners])


def _channel(slot: Slot) -> Polygon:
    """Lengthens the slot outwards until it has left the unit."""
    return _rectangle(slot, -_BACK * slot.width, slot.depth, -slot.width / 2, slot.width / 2)


def _front(slot: Slot) -> Polygon:
    """Widens the part of the channel before the mouth."""
    side = slot.width
    return _rectangle(slot, -_BACK * slot.width, 0.0, -side, side)


def _tips(slot: Slot, truncated: tuple[float, float], settings: Fabrication) -> Iterable[Polygon]:
    """Yields where the walls beside the slot are thinner than the tips."""
    right, left = truncated
    side = slot.width / 2 + settings.slots.tip + GRID
    # From the middle of the slot: rectangles that only touch may leave a hairline between them.
    for length, across in ((right, (-side, 0.0)), (left, (0.0, side))):
        if length > GRID:
            yield _rectangle(slot, -_BACK * slot.width, length, *across)


def _largest(shape: BaseGeometry) -> Polygon:
    """Keeps the largest piece, counter-clockwise and without holes."""
    pieces = [piece for piece in shapely.get_parts(shape) if isinstance(piece, Polygon)]
    piece = max(pieces, key=lambda piece: piece.area)
    return shapely.orient_polygons(Polygon(piece.exterior))
