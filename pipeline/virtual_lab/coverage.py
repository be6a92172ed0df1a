"""Computes the exact coverage of pixels by polygons: what a pixel integrates, without samples.

Every edge adds to a buffer by how much the coverage changes from one pixel of a row to the next;
its running sum along the rows is the picture. It is linear, so polygons that lie within others
carry the difference of their shades, and all go into one buffer.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pipeline.runtime import compiled
from sim.core import Floats, Ints


class NestedPolygons(NamedTuple):
    """Holds closed polygons, one behind the other."""

    points: Floats  # (n, 2) vertices, column and row
    start: Ints  # (rings + 1,) where each begins
    # (rings,) what each adds where it covers, if it runs counter-clockwise as seen (rows count
    # downwards); the negative of it for one that runs the other way
    shade: Floats


def mean_polygons(pictures: Sequence[NestedPolygons]) -> NestedPolygons:
    """Joins the polygons of several pictures to those of their mean."""
    sizes = np.concatenate([np.diff(one.start) for one in pictures])
    return NestedPolygons(
        np.concatenate([one.points for one in pictures]),
        np.concatenate([[0], np.cumsum(sizes)]),
        np.concatenate([one.shade for one in pictures]) / len(pictures),
    )


def coverage_image(rings: NestedPolygons, shape: tuple[int, int]) -> Floats:
    """Averages the shade (rows, columns) over each pixel; pixel (0, 0) reaches from -0.5 to 0.5."""
    picture = np.zeros((shape[0], shape[1] + 2))
    points = np.ascontiguousarray(rings.points + 0.5)
    _integrate(points, rings.start, rings.shade, picture, picture.shape[1])
    return picture[:, : shape[1]]


@compiled
def _integrate(
    points: Floats,
    start: Ints,
    shade: Floats,
    picture: Floats,
    columns: int,
    n_shade: int = 0,
    n_picture: int = 0,
) -> None:
    """Sums what each edge changes (rows, columns) from one pixel of a row to the next."""
