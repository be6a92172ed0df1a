"""The mark that tells how a unit stands: an arrow to +y, or a small ring at its upper end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.engraving.free_boxes import room_for
from pipeline.fabrication.engraving.id_placement import MARGINS, clipped, total_length
from pipeline.fabrication.engraving.stroke_font import on_grid, turned
from pipeline.fabrication.parts import Strokes
from pipeline.problem.sections import Labels
from sim.core import Floats

_MOST, _LEAST = 1.5, 0.8  # mm
_KEPT = 0.9  # of an arrow that a slot cuts
_RING = 0.3  # mm, radius
_ARROW = ("00 23 40", "20 23")  # on a grid of 4 by 3


def mark(outline: Polygon, body: Polygon, taken: shapely.Geometry, wanted: Labels) -> Strokes:
    """An arrow to +y, near to the place that is taken; a small ring at the upper end if no room."""
    for arrow in _arrows((outline.difference(taken), body.difference(taken)), taken, wanted):
        kept = clipped(arrow, outline)
        if total_length(kept) > _KEPT * total_length(arrow):
            return kept
    return (_ring(outline),)


def _arrows(
    places: Sequence[BaseGeometry], taken: BaseGeometry, wanted: Labels
) -> Iterator[Strokes]:
    """Arrows that fit into the places, from the best to the last resort."""
    near = (taken.centroid.x, taken.centroid.y)
    for place in places:
        for size in (_MOST, 0.8 * _MOST, _LEAST):
            pen = min(wanted.stroke, 0.4 * size)
            for margin in MARGINS:
                box = (size + pen + 2 * margin, 0.75 * size + pen + 2 * margin)
                centre = room_for(box, 0.0, place, near)
                if centre is not None:
                    scaled = tuple((on_grid(line) - [2.0, 1.5]) * size / 4 for line in _ARROW)
                    yield turned(scaled, 0.0, centre)


def _ring(outline: Polygon) -> Floats:
    inner = outline.buffer(-_RING - MARGINS[-1])
    points = shapely.get_coordinates(
        inner if not inner.is_empty else outline.representative_point()
    )
    turn = np.linspace(0.0, 2 * np.pi, 9)
    top = points[np.lexsort((points[:, 0], points[:, 1]))[-1]]
    return top + _RING * np.column_stack([np.cos(turn), np.sin(turn)])
