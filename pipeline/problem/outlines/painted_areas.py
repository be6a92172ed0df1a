"""Finds the outlines of what the paths of a drawing paint, each over those before it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from shapely import Geometry, Polygon
    from svgelements import Path as SvgPath

MOST_CROSSINGS = 2000
"""Of the edges of one fill."""
_AT_ONCE = 100  # edges whose crossings are looked for together
_NEGLIGIBLE = 1e-9
"""Share of a whole area that rounding leaves."""
_EDGES = (slice(None, -1), slice(1, None))
"""Of a ring's points, those at which edges start and end."""


class Painted(NamedTuple):
    """Holds the outlines of a path, and how they are painted."""

    in_shape: bool
    filled: bool
    pieces: list[NDArray[Any]]


def pieces_of(path: SvgPath, chords: int) -> list[NDArray[Any]]:
    """Lists the outlines of a path's pieces that have an area, with that many chords a curve."""
    return [points for points in _pieces(path, chords) if len(points) > 2]


def _pieces(path: SvgPath, chords: int) -> Iterator[NDArray[Any]]:
    """Yields the outline of each piece of a path, from one move to the next."""
    from svgelements import Close, Line, Move

    places: list[tuple[float, float]] = []
    for segment in path:
        if isinstance(segment, Move):
            yield _without_repeats(places)
            places = []
        elif segment.end is not None:
            count = 1 if isinstance(segment, Line | Close) else chords
            points = (segment.point(k / count) for k in range(1, count + 1))
            places += [(float(point.x), float(point.y)) for point in points]
    yield _without_repeats(places)


def _without_repeats(places: list[tuple[float, float]]) -> NDArray[Any]:
    before = places[-1:] + places[:-1]
    kept = [here for here, last in zip(places, before, strict=True) if here != last]
    return np.array(kept).reshape(-1, 2)


def painted_outlines(paths: list[Painted]) -> list[NDArray[Any]]:
    """Lists outlines of what is in the shape, each path being painted over those before it."""
    import shapely

    if _apart(paths):
        return [points for each in paths for points in each.pieces]
    shape = shapely.Polygon()
    for in_shape, layer in groupby(paths, key=attrgetter("in_shape")):
        area = shapely.union_all(_areas([*layer]))
        shape = shape | area if in_shape else shape - area
    return _rings(shape)


def _apart(paths: list[Painted]) -> bool:
    """Tells paths that are all in the shape and overlap nowhere, so that it has their outlines."""
    import shapely

    if not all(each.in_shape for each in paths):
        return False
    each_area = _areas(paths)
    whole = shapely.union_all(each_area).area
    return sum(area.area for area in each_area) <= (1.0 + _NEGLIGIBLE) * whole


def _areas(paths: list[Painted]) -> list[Geometry]:
    """Lists the areas of fills, and the one that an odd number of lines without a fill encloses."""
    fills = [each.pieces for each in paths if each.filled]
    lines = [points for each in paths if not each.filled for points in each.pieces]
    return [filled_area(pieces) for pieces in (*fills, lines)]


def filled_area(pieces: list[NDArray[Any]]) -> Geometry:
    """Finds the area within an odd number of outlines."""
    import shapely

    return shapely.make_valid(shapely.MultiPolygon([shapely.Polygon(each) for each in pieces]))


def nonzero_outlines(pieces: list[NDArray[Any]]) -> list[NDArray[Any]]:
    """Lists outlines, an odd number round each point in the area that the pieces wind round.

    They are the pieces themselves where either rule, nonzero or even-odd, fills the same.

    Raises:
        ValueError: the pieces cross themselves and one another too often.
    """
    import shapely

    if len(pieces) < 2 and all(shapely.Polygon(points).is_valid for points in pieces):
        return pieces
    rings = [np.vstack([points, points[:1]]) for points in pieces]
    starts, ends = (np.concatenate([ring[cut] for ring in rings]) for cut in _EDGES)
    _check_crossings(starts, ends)
    crossed = shapely.union_all([shapely.LineString(ring) for ring in rings])
    parts = list(shapely.get_parts(shapely.polygonize(shapely.get_parts(crossed))))
    turns = [_winding(part, starts, ends) for part in parts]
    least = _NEGLIGIBLE * sum(part.area for part in parts)
    if not any(
        turn and turn % 2 == 0 and part.area > least
        for part, turn in zip(parts, turns, strict=True)
    ):
        return pieces
    return _rings(_union(part for part, turn in zip(parts, turns, strict=True) if turn))


def _check_crossings(starts: NDArray[Any], ends: NDArray[Any]) -> None:
    import shapely

    edges = shapely.linestrings(np.stack([starts, ends], axis=1))
    tree, found = shapely.STRtree(edges), 0
    for first in range(0, len(edges), _AT_ONCE):
        pairs = tree.query(edges[first : first + _AT_ONCE], predicate="crosses")
        found += pairs.shape[1]  # each pair twice
        if found > 2 * MOST_CROSSINGS:
            raise ValueError("a fill crosses itself too often; simplify it")


def _union(parts: Iterable[Polygon]) -> Geometry:
    import shapely

    return shapely.union_all(list(parts))


def _winding(part: Polygon, starts: NDArray[Any], ends: NDArray[Any]) -> int:
    """Counts how often edges wind round a part that none of them crosses."""
    inner = part.representative_point()
    below, above = starts[:, 1] <= inner.y, ends[:, 1] > inner.y
    up, down = below & above, ~below & ~above
    (dx, dy), (x, y) = (ends - starts).T, (starts - [inner.x, inner.y]).T
    left = dx * y - dy * x  # positive where the point lies to the left of the edge
    return int(np.sum(up & (left < 0.0))) - int(np.sum(down & (left > 0.0)))


def _rings(shape: Geometry) -> list[NDArray[Any]]:
    import shapely

    parts = [part for part in shapely.get_parts(shape) if part.area > 0.0]
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return [np.array(ring.coords)[:-1] for ring in rings]
