"""Builds a lattice from lists of polygons and ligaments."""

from collections.abc import Sequence

import numpy as np

from sim.core import Floats
from sim.structure.lattice import Lattice, moments, network

REACH = 0.05
"""A ligament given by its end points ends at the vertex within this share of the spacing."""


def listed(
    polygons: Sequence[Sequence[tuple[float, float]]],
    ligaments: Sequence[tuple[tuple[float, float], tuple[float, float]]],
    spacing: float,
) -> Lattice:
    """Builds units from lists of corners (mm), either way round, and ligaments from end points.

    Raises:
        ValueError: a polygon without area or on another, or a ligament that is listed twice or does
            not end at two units' vertices.
    """
    from scipy.spatial import cKDTree

    rings = [_counter_clockwise(np.array(polygon, dtype=float)) for polygon in polygons]
    _refuse_covered(rings)
    vertices = np.concatenate(rings)
    unit = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    known: dict[frozenset[int], int] = {}
    ends = np.array(ligaments, dtype=float).reshape(-1, 2, 2)
    distance, place = cKDTree(vertices).query(ends)
    for number, (far, (one, other)) in enumerate(zip(distance, place, strict=True)):
        where = "ligament {} from ({:g}, {:g}) to ({:g}, {:g}) mm".format(
            number, *np.round(ends[number].ravel(), 3)
        )
        if far.max() > REACH * spacing:
            raise ValueError(f"{where} ends {far.max():.3g} mm away from any unit's corner")
        if unit[one] == unit[other]:
            raise ValueError(f"{where} begins and ends at the same unit")
        first = known.setdefault(frozenset((int(one), int(other))), number)
        if first != number:
            raise ValueError(f"{where} is listed before, as number {first}")
    index = np.stack([np.arange(len(rings)), np.zeros(len(rings), dtype=np.int64)], axis=1)
    return network(rings, place, index, spacing)


def _refuse_covered(rings: list[Floats]) -> None:
    """Refuses two polygons of which one covers more than half of the other."""
    import shapely

    shapes = shapely.make_valid(np.array([shapely.Polygon(ring) for ring in rings]))
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    first, second = first[first < second], second[first < second]
    shared = shapely.area(shapely.intersection(shapes[first], shapes[second]))
    smaller = np.minimum(shapely.area(shapes[first]), shapely.area(shapes[second]))
    for covering in np.flatnonzero(shared > smaller / 2):
        one, other = first[covering], second[covering]
        x, y = np.round(moments(rings[one])[1], 3) + 0.0
        raise ValueError(f"polygons {one} and {other} lie in one place, about ({x:g}, {y:g}) mm")


def _counter_clockwise(ring: Floats) -> Floats:
    area = moments(ring)[0] if len(ring) > 0 else 0.0
    if abs(area) < 1e-9 or not np.isfinite(area):
        raise ValueError(f"a polygon of {len(ring)} corners has no area")
    return ring if area > 0 else ring[::-1]
