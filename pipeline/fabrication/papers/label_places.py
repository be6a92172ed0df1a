"""Places the words of the assembly plan: ids on their units, numbers beside their shims."""

from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from shapely import Geometry, Polygon

from pipeline.fabrication.papers.pdf_paper import POINT
from sim.core import Floats

Corners = tuple[float, float, float, float]
"""Left, bottom, right, top of a box, mm."""

_ID, _SMALLEST = 6.5, 5.0  # points; on units too small for that an id reaches beyond
_ASPECT = 0.75  # a letter's width to its size, with some room
_STEP = 0.25  # mm between places that are tried for an id
_STROKE = 0.2  # mm on both sides of a shim's line
_AT_ONCE = 64  # places that are tried, from the nearest on
_OUTSIDE = 5.0  # mm^-2 for what of an id is not on its unit
_DISTANCES = np.array([1.8, 2.4, 3.0, 3.7, 4.5, 5.5, 6.5, 8.0])  # mm from the shim's middle
_TURNS = np.deg2rad(np.arange(0.0, 360.0, 15.0) + 45.0)
_CROSSED = 3.0  # mm farther are as bad as the line of another shim beneath
_COVERED = 100.0  # mm^-2 for what must not be covered


def name_places(
    outlines: Sequence[Polygon],
    names: Sequence[str],
    paths: Sequence[Floats],
    taken: Sequence[Corners],
) -> list[tuple[float, float, float]]:
    """Finds the middle of each id on its unit, mm, and its size of type, points.

    It is where the unit is widest, unless another unit, a shim, an arrow or an id before it lies
    there: then where an id of the smallest type is covered and reaches beyond its unit least.

    Args:
        outlines: of the units.
        names: their ids.
        paths: (n, 2) lines of the shims, mm.
        taken: boxes of arrows.
    """
    strips = [shapely.LineString(path).buffer(_STROKE) for path in paths]
    drawn = [*outlines, *strips, *(shapely.box(*box) for box in taken)]
    tree, places = shapely.STRtree(drawn), list[tuple[float, float, float]]()
    written: list[Geometry] = []
    for number, (outline, name) in enumerate(zip(outlines, names, strict=True)):
        widest = _widest_place(outline, name)
        reach = shapely.box(*outline.bounds).union(shapely.box(*name_box(name, widest)))
        near = (drawn[at] for at in sorted(tree.query(reach).tolist()) if at != number)
        others = shapely.union_all([*near, *(box for box in written if box.intersects(reach))])
        places.append(_clear_place(outline, name, widest, others))
        written.append(shapely.box(*name_box(name, places[-1])))
    return places


def name_box(name: str, place: tuple[float, float, float]) -> Corners:
    """Measures the box of an id by its middle, mm, and its size of type, points."""
    x, y, size = place
    half = _ASPECT * len(name) * size / POINT / 2
    return x - half, y - 0.45 * size / POINT, x + half, y + 0.45 * size / POINT


def _widest_place(outline: Polygon, name: str) -> tuple[float, float, float]:
    """Finds the middle of a unit, where it is widest, and the size of type that fits there."""
    circle = shapely.maximum_inscribed_circle(outline, tolerance=0.05)
    (x, y), radius = circle.coords[0], float(circle.length)
    fitting = 2.0 * radius * POINT / (_ASPECT * len(name))
    return x, y, min(_ID, max(_SMALLEST, fitting))


def _clear_place(
    outline: Polygon, name: str, widest: tuple[float, float, float], others: Geometry
) -> tuple[float, float, float]:
    """Finds the place of an id that others cover least, the widest one if they do not cover it."""
    if shapely.box(*name_box(name, widest)).intersection(others).area == 0.0:
        return widest
    left, low, right, high = outline.bounds
    x, y = (
        grid.ravel()
        for grid in np.meshgrid(np.arange(left, right, _STEP), np.arange(low, high, _STEP))
    )
    inside = shapely.contains_xy(outline, x, y)
    x, y = np.append(x[inside], widest[0]), np.append(y[inside], widest[1])
    half, _, _, up = name_box(name, (0.0, 0.0, _SMALLEST))
    away = np.hypot(x - widest[0], y - widest[1])
    cost = np.full(len(x), np.inf)
    for near in np.array_split(np.argsort(away, kind="stable"), -(-len(x) // _AT_ONCE)):
        if np.round(away[near[0]], 6) > cost.min():  # nothing farther costs less
            break
        boxes = shapely.box(x[near] + half, y[near] - up, x[near] - half, y[near] + up)
        covered = shapely.area(shapely.intersection(boxes, others))
        outside = shapely.area(shapely.difference(boxes, outline))
        cost[near] = np.round(away[near] + _COVERED * covered + _OUTSIDE * outside, 6)
    best = int(np.argmin(cost))
    return float(x[best]), float(y[best]), _SMALLEST


def number_places(
    middles: Mapping[int, Floats],
    sizes: Mapping[int, tuple[float, float]],
    paths: Mapping[int, Floats],
    taken: Sequence[Corners],
) -> dict[int, tuple[float, float]]:
    """Finds the middle of each number, near to its shim and clear of all else.

    Args:
        middles: (2,) of shims, mm, by id.
        sizes: width and height of the numbers' boxes, by id.
        paths: (n, 2) lines of the shims, by id.
        taken: boxes (left, bottom, right, top) of ids and arrows.
    """
    reach, turn = (grid.ravel() for grid in np.meshgrid(_DISTANCES, _TURNS, indexing="ij"))
    aside = reach[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    lines, owners = [shapely.LineString(path) for path in paths.values()], np.array(list(paths))
    tree, boxes = shapely.STRtree(lines), np.array(taken, dtype=float).reshape(-1, 4)
    places = {}
    for number, middle in middles.items():
        half, spots = np.array(sizes[number]) / 2, middle + aside
        corners = np.column_stack([spots - half, spots + half])
        over, under = tree.query(shapely.box(*corners.T), "intersects")
        crossed = np.bincount(over[owners[under] != number], minlength=len(spots))
        cost = reach + _CROSSED * crossed + _COVERED * _covered(corners, _near(corners, boxes))
        best = int(np.argmin(np.round(cost, 6)))
        places[number] = (float(spots[best, 0]), float(spots[best, 1]))
        boxes = np.vstack([boxes, corners[best]])
    return places


def _near(boxes: Floats, others: Floats) -> Floats:
    """Selects the boxes (m, 4) of others that the one around boxes (n, 4) meets."""
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    return others[((others[:, :2] < high) & (others[:, 2:] > low)).all(axis=1)]


def _covered(boxes: Floats, others: Floats) -> Floats:
    """Measures the areas (n,) that boxes (n, 4) share with others (m, 4)."""
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    return np.asarray(np.clip(high - low, 0.0, None).prod(axis=-1).sum(axis=-1))
