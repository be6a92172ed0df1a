"""Plates are cut apart between units, or where fewest of these are cut."""

import numpy as np
import pytest
import shapely

from pipeline.fabrication.fixtures.flat_fixtures import axis_cuts
from sim.core import Floats
from sim.structure import Lattice, honeycomb, kagome, quads, triangular

BED = 120.0
TILT = np.deg2rad(20.0)


def spans_of(lattice: Lattice) -> tuple[Floats, Floats]:
    shapes = [shapely.Polygon(lattice.vertices[lattice.unit == n]) for n in lattice.id]
    bounds = shapely.bounds(shapes)
    return bounds[:, ::2], bounds[:, 1::2]


def cut_units(spans: Floats, places: list[float]) -> int:
    return sum(int(((p - spans[:, 0] > 1.0) & (spans[:, 1] - p > 1.0)).sum()) for p in places)


def test_squares_are_cut_apart_between_their_sites() -> None:
    for spans in spans_of(quads(12, 12, 15.0, 2.25, TILT)):
        first, *inner, last = axis_cuts(spans, 15.0, BED, 6.0)
        assert (first, last) == (spans.min() - 6.0, spans.max() + 6.0)
        assert inner == [82.5]


@pytest.mark.parametrize(
    ("lattice", "most"),
    [
        (triangular(12, 12, 15.0, 2.25), (6, 0)),  # rows are shifted by half a unit
        (honeycomb(12, 10, 15.0, 2.25, 0.2), (10, 0)),
        (kagome(8, 8, 15.0, 2.25, 1.5, np.pi / 2), (0, 0)),
        (kagome(8, 8, 15.0, 2.25, 0.0, np.pi / 3), (0, 0)),
    ],
)
def test_other_lattices_are_cut_where_fewest_units_are(
    lattice: Lattice, most: tuple[int, int]
) -> None:
    for spans, allowed in zip(spans_of(lattice), most, strict=True):
        edges = axis_cuts(spans, 15.0, BED, 6.0)
        assert max(np.diff(edges)) <= BED
        assert cut_units(spans, edges[1:-1]) <= allowed
