"""Where boxes fit into an outline."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from pipeline.fabrication.engraving.stroke_font import turned
from sim.core import Floats

_STEP = 0.35  # mm
_GRID = 1e-6  # mm


def room_for(
    box: tuple[float, float],
    angle: float,
    outline: Polygon,
    near: tuple[float, float] | None = None,
) -> tuple[float, float] | None:
    """Centre of a box inside an outline, as near as can be to its centroid or to ``near``."""
    target = outline.centroid if near is None else shapely.Point(near)
    found = spots(box, angle, outline, _STEP, target)
    if not len(found):
        return None
    distance = np.linalg.norm(found - [target.x, target.y], axis=1)
    x, y = found[np.argmin(np.round(distance, 6))]
    return float(x), float(y)


def spots(
    box: tuple[float, float],
    angle: float,
    outline: Polygon,
    step: float,
    target: shapely.Point,
) -> Floats:
    """Centres (n, 2) of boxes inside an outline: on a grid, and the nearest to a target.

    The centre lies in each copy of the outline that is shifted by minus a point of the box's rim.
    """
    rim = np.asarray(box_at(box, angle, (0.0, 0.0)).exterior.coords)
    rim = np.concatenate([rim[:-1], (rim[:-1] + rim[1:]) / 2])
    copies = [shapely.transform(outline, lambda at, by=by: at - by) for by in rim]
    try:
        region = shapely.intersection_all(copies)
    except shapely.GEOSException:  # it gives up where copies nearly coincide
        region = shapely.intersection_all(shapely.set_precision(copies, _GRID))
    if region.area == 0.0:
        return np.empty((0, 2))
    nearest = shapely.get_coordinates(shapely.shortest_line(region, target))[0]
    x0, y0, x1, y1 = region.bounds
    x, y = np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step))
    grid = np.column_stack([x.ravel(), y.ravel()])
    centres = np.concatenate([nearest[None], grid[shapely.contains_xy(region, grid)]])
    boxes = shapely.polygons(centres[:, None, :] + rim[[0, 4, 1, 5, 2, 6, 3, 7]] * (1.0 - 1e-6))
    shapely.prepare(outline)
    fits: Floats = centres[shapely.contains(outline, boxes)]
    return fits


def box_at(size: tuple[float, float], angle: float, centre: tuple[float, float]) -> Polygon:
    """A box of a size about its centre, turned."""
    width, height = size[0] / 2, size[1] / 2
    rim = np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    return Polygon(turned((rim,), angle, centre)[0])
