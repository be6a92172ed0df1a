"""Moves an outline from its sheet or plate back to where the design has the unit."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from sim.core import Floats

_PARALLEL = 1e-3  # rad
_ROUNDS = (1.5, 0.5, 0.1, 0.02, 0.02)  # mm; edges farther apart are not the same edge


def aligned(design: Polygon, made: Polygon) -> Polygon:
    """The outline `made`, shifted so that what is left of the design's edges lies on them.

    Slots, cut tips and thickened corners do not count: an edge is only compared with parallel
    segments near it, at ever smaller distances.
    """
    edges = _edges(design)
    moved = _shifted(made, np.subtract(design.centroid.coords[0], made.centroid.coords[0]))
    for most in _ROUNDS:
        moved = _shifted(moved, _step(edges, _edges(moved), most))
    return moved


def _edges(shape: Polygon) -> tuple[Floats, Floats, Floats]:
    """Middle points (n, 2), unit normals (n, 2) and lengths (n,) of the sides."""
    points = np.asarray(shapely.orient_polygons(shape).exterior.coords)
    along = np.diff(points, axis=0)
    length = np.linalg.norm(along, axis=1)
    kept = length > 1e-6
    normal = (along[:, ::-1] * [1.0, -1.0])[kept] / length[kept, None]
    return (points[:-1] + along / 2)[kept], normal, length[kept]


def _step(
    edges: tuple[Floats, Floats, Floats], segments: tuple[Floats, Floats, Floats], most: float
) -> Floats:
    """The shift that brings segments nearest to the edges that they belong to."""
    (at, normal, _), (middle, outward, length) = edges, segments
    parallel = outward @ normal.T > np.cos(_PARALLEL)
    apart = ((at[None] - middle[:, None]) * normal[None]).sum(axis=-1)
    distance = np.where(parallel, np.abs(apart), np.inf)
    nearest = distance.argmin(axis=1)
    rows = np.arange(len(middle))
    near = distance[rows, nearest] < most
    weight = np.sqrt(length[near])
    matrix = normal[nearest[near]] * weight[:, None]
    shift: Floats = np.linalg.lstsq(matrix, apart[rows, nearest][near] * weight, rcond=1e-6)[0]
    return shift


def _shifted(shape: Polygon, by: Floats) -> Polygon:
    moved: Polygon = shapely.transform(shape, lambda points: points + by)
    return moved
