"""Builds printed parts as stacks of layers, and their closed meshes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.parts.specimen_parts import Circle, Strokes, Unit
from pipeline.problem.sections import Fabrication
from sim.core import Floats, Ints

if TYPE_CHECKING:
    from manifold3d import Manifold

MERGED = 0.02
"""Growth of lettering, so that its pieces do not touch in a point, mm."""

_QUARTER = 8  # segments per quarter circle
_PEN_QUARTER = 2  # of the round ends of strokes
_SPECK = 1e-6  # mm^2
_RESOLVED = 1e-4  # mm; single precision in an STL would make triangles of shorter edges collapse
_RIM = 0.15  # mm that letters leave of the outline
_GRID = 1e-3  # mm, of letters


class Layer(NamedTuple):
    """Holds an area that is filled from one height to another, mm."""

    area: Polygon | MultiPolygon
    bottom: float
    top: float


class Mesh(NamedTuple):
    """Holds a closed surface."""

    vertices: Floats  # (n, 3) mm
    faces: Ints  # (m, 3) indices, counter-clockwise from outside

    def moved(self, x: float, y: float) -> Mesh:
        """Shifts the mesh on the bed."""
        return Mesh(self.vertices + np.array([x, y, 0.0]), self.faces)


@dataclass(frozen=True)
class PrintedPart:
    """Holds a printed part, as it lies on the bed."""

    id: str  # unique in the package; the name of its files and objects
    layers: tuple[Layer, ...]  # from the bed (z = 0) upwards; they do not overlap

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Box of all layers in x and y."""
        x0, y0, x1, y1 = shapely.total_bounds([layer.area for layer in self.layers])
        return float(x0), float(y0), float(x1), float(y1)

    @property
    def size(self) -> tuple[float, float]:
        """Width and depth on the bed."""
        x0, y0, x1, y1 = self.bounds
        return x1 - x0, y1 - y0

    @cached_property
    def mesh(self) -> Mesh:
        """Its surface, with the lower left corner of its box at the origin."""
        from manifold3d import Manifold, OpType

        x0, y0, _, _ = self.bounds
        stack = [_extruded(layer) for layer in self.layers]
        solid = Manifold.batch_boolean(stack, OpType.Add).translate((-x0, -y0, 0.0))
        surface = solid.simplify(_RESOLVED).to_mesh64()
        vertices = np.asarray(surface.vert_properties)[:, :3]
        return Mesh(vertices, np.asarray(surface.tri_verts, dtype=np.int64))


def _extruded(layer: Layer) -> Manifold:
    from manifold3d import CrossSection, FillRule, Manifold

    loops = [
        np.asarray(ring.coords)[:-1]
        for part in shapely.get_parts(layer.area)
        for ring in (part.exterior, *part.interiors)
    ]
    section = CrossSection(loops, FillRule.EvenOdd)
    return Manifold.extrude(section, layer.top - layer.bottom).translate((0.0, 0.0, layer.bottom))


def solid_area(area: BaseGeometry) -> Polygon | MultiPolygon:
    """Keeps the polygons of a shape, without specks and dangling lines."""
    pieces = [
        part for part in shapely.get_parts(area) if isinstance(part, Polygon) and part.area > _SPECK
    ]
    return pieces[0] if len(pieces) == 1 else MultiPolygon(pieces)


def pen_area(strokes: Strokes, width: float) -> BaseGeometry:
    """Covers the area of a round pen along strokes."""
    lines = [LineString(stroke) for stroke in strokes]
    return shapely.union_all(shapely.buffer(lines, width / 2, quad_segs=_PEN_QUARTER))


def engraved_area(area: BaseGeometry) -> BaseGeometry:
    """Grows lettering a little: pieces that touch in a point would leave an open mesh."""
    return area.buffer(MERGED, join_style="mitre")


def discs(circles: Iterable[Circle]) -> BaseGeometry:
    """Covers the area of circles."""
    return shapely.union_all(
        [
            shapely.Point(circle.centre).buffer(circle.diameter / 2, quad_segs=_QUARTER)
            for circle in circles
        ]
    )


def unit_solid(unit: Unit, settings: Fabrication) -> PrintedPart:
    """Stacks a unit with its id and arrow sunk into the underside, and with its tracking dots."""
    height, outline, sunk = unit.height, unit.outline, settings.labels.depth
    marks, dots = settings.markers, discs(unit.markers)
    inset = settings.print.first_layer_inset
    inner = outline.buffer(-inset, join_style="mitre") if inset else outline
    lettering = _lettering(unit, inner, settings)
    while _is_pinched(base := outline.difference(lettering)):
        lettering = engraved_area(lettering)
    lettered = solid_area(base)
    split = min(settings.print.layer, sunk) if inset else 0.0
    layers = [Layer(lettered, split, sunk)]
    if inset:
        layers.insert(0, Layer(solid_area(inner.difference(lettering)), 0.0, split))
    if marks.kind == "recess":
        layers.append(Layer(outline, sunk, height - marks.depth))
        layers.append(Layer(solid_area(outline.difference(dots)), height - marks.depth, height))
    else:
        layers.append(Layer(outline, sunk, height))
    if marks.kind == "dots" and unit.markers:
        layers.append(Layer(solid_area(dots.intersection(outline)), height, height + marks.depth))
    return PrintedPart(unit.label, tuple(layer for layer in layers if layer.top > layer.bottom))


def _is_pinched(area: BaseGeometry) -> bool:
    """Tests that rings of an area meet in a point, so that a mesh of it is not closed there."""
    parts = (part for part in shapely.get_parts(area) if isinstance(part, Polygon))
    rings = np.array([ring for part in parts for ring in (part.exterior, *part.interiors)])
    one, other = np.triu_indices(len(rings), 1)
    return bool((shapely.distance(rings[one], rings[other]) < _RESOLVED).any())


def _lettering(unit: Unit, within: BaseGeometry, settings: Fabrication) -> BaseGeometry:
    """Covers the letters and the mark on a unit's underside, up to a rim `within` an area.

    Small letters have thinner strokes.
    """
    x0, y0, x1, y1 = shapely.total_bounds([LineString(stroke) for stroke in unit.underside])
    width = min(settings.labels.stroke, max(0.3, 0.2 * min(x1 - x0, y1 - y0)))
    mark = pen_area(unit.mark, min(settings.labels.stroke, 0.4))
    letters = pen_area(unit.underside, float(width)).union(mark)
    room = within.buffer(-_RIM, join_style="mitre")  # also keeps nearly equal vertices apart
    return engraved_area(shapely.set_precision(letters.intersection(room), _GRID))
