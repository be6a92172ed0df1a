"""Computes the exact coverage of pixels by polygons: what a pixel integrates, without samples.

Every edge adds to a buffer by how much the coverage changes from one pixel of a row to the next;
its running sum along the rows is the picture. It is linear, so polygons that lie within others
carry the difference of their shades, and all go into one buffer.
"""

import math
from typing import NamedTuple

import numpy as np

from pipeline.runtime import compiled, inlined
from sim.core import Floats, Ints


class NestedPolygons(NamedTuple):
    """Holds closed polygons, one behind the other."""

    points: Floats  # (n, 2) vertices, column and row
    start: Ints  # (rings + 1,) where each begins
    # (rings,) what each adds where it covers, if it runs counter-clockwise as seen (rows count
    # downwards); the negative of it for one that runs the other way
    shade: Floats


def coverage_image(rings: NestedPolygons, shape: tuple[int, int]) -> Floats:
    """Averages the shade (rows, columns) over each pixel; pixel (0, 0) reaches from -0.5 to 0.5."""
    change = np.zeros((shape[0], shape[1] + 2))
    _accumulate(rings.points + 0.5, rings.start, rings.shade, change)
    return np.cumsum(change, axis=1)[:, : shape[1]]


@compiled
def _accumulate(points: Floats, start: Ints, shade: Floats, change: Floats) -> None:
    for ring in range(shade.size):
        first, end = start[ring], start[ring + 1]
        for k in range(first, end):
            following = k + 1 if k + 1 < end else first
            _edge(points[k], points[following], shade[ring], change)


@inlined
def _edge(a: Floats, b: Floats, shade: float, change: Floats) -> None:
    """Adds an edge, row by row; what is to its right is covered if it runs downwards."""
    if a[1] == b[1]:
        return
    sign, low, high = (-shade, b, a) if a[1] > b[1] else (shade, a, b)
    slope = (high[0] - low[0]) / (high[1] - low[1])
    rows, most = change.shape[0], change.shape[1] - 2.0
    for row in range(max(0, math.floor(low[1])), min(rows, math.ceil(high[1]))):
        top, bottom = max(low[1], row), min(high[1], row + 1)
        x, y = low[0] + slope * (top - low[1]), low[0] + slope * (bottom - low[1])
        left, right = min(max(min(x, y), 0.0), most), min(max(x, y, 0.0), most)
        before = 0.0
        for column in range(int(left), int(right) + 2):
            covered = _mean_excess(column + 1.0, left, right) - _mean_excess(column, left, right)
            change[row, column] += sign * (bottom - top) * (covered - before)
            before = covered


@inlined
def _mean_excess(value: float, left: float, right: float) -> float:
    """Returns the mean of max(value - x, 0) for x from left to right."""
    if value <= left:
        return 0.0
    if value >= right:
        return value - 0.5 * (left + right)
    return 0.5 * (value - left) ** 2 / (right - left)
