"""Printed parts as stacks of layers, and their closed meshes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.parts.made_parts import Circle, Strokes, Unit
from pipeline.problem.sections import Fabrication
from sim.core import Floats

_QUARTER = 8  # segments per quarter circle
_PEN_QUARTER = 2  # of the round ends of strokes
_SPECK = 1e-6  # mm^2
_RESOLVED = 1e-4  # mm; single precision in an STL would make triangles of shorter edges collapse
_RIM = 0.15  # mm that letters leave of the outline
_GRID = 1e-3  # mm, of letters
MERGED = 0.02
"""By how much lettering grows so that its pieces do not touch in a point, mm."""


class Layer(NamedTuple):
    """An area that is filled from one height to another, mm."""

    area: Polygon | MultiPolygon
    bottom: float
    top: float


class Mesh(NamedTuple):
    """A closed surface.

    Attributes:
        vertices: (n, 3) mm.
        faces: (m, 3) indices, counter-clockwise from outside.
    """

    vertices: Floats
    faces: NDArray[np.int64]

    def moved(self, x: float, y: float, z: float = 0.0) -> Mesh:
        """The mesh shifted."""
        return Mesh(self.vertices + np.array([x, y, z]), self.faces)


@dataclass(frozen=True)
class PrintedPart:
    """A printed part, as it lies on the bed.

    Attributes:
        id: unique in the package; the name of its files and objects.
        layers: from the bed (z = 0) upwards; they do not overlap.
    """

    id: str
    layers: tuple[Layer, ...]

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

    @property
    def volume(self) -> float:
        """In mm^3."""
        return float(sum(area.area * (top - bottom) for area, bottom, top in self.layers))

    @cached_property
    def mesh(self) -> Mesh:
        """Its surface, with the lower left corner of its box at the origin."""
        from manifold3d import Manifold, OpType

        x0, y0, _, _ = self.bounds
        stack = [_extruded(layer) for layer in self.layers]
        whole = Manifold.batch_boolean(stack, OpType.Add).translate((-x0, -y0, 0.0))
        found = whole.simplify(_RESOLVED).to_mesh64()
        return Mesh(
            np.asarray(found.vert_properties)[:, :3], np.asarray(found.tri_verts, dtype=np.int64)
        )


def _extruded(layer: Layer):  # type: ignore[no-untyped-def]  # noqa: ANN202
    from manifold3d import CrossSection, FillRule, Manifold

    loops = [
        np.asarray(ring.coords)[:-1]
        for part in shapely.get_parts(layer.area)
        for ring in (part.exterior, *part.interiors)
    ]
    section = CrossSection(loops, FillRule.EvenOdd)
    return Manifold.extrude(section, layer.top - layer.bottom).translate((0.0, 0.0, layer.bottom))


def flat(area: BaseGeometry) -> Polygon | MultiPolygon:
    """The polygons of a shape, without specks and dangling lines."""
    pieces = [
        part for part in shapely.get_parts(area) if isinstance(part, Polygon) and part.area > _SPECK
    ]
    return pieces[0] if len(pieces) == 1 else MultiPolygon(pieces)


def pen(strokes: Strokes, width: float) -> BaseGeometry:
    """The area that a round pen covers along strokes."""
    lines = [LineString(stroke) for stroke in strokes]
    return shapely.union_all(shapely.buffer(lines, width / 2, quad_segs=_PEN_QUARTER))


def merged(area: BaseGeometry) -> BaseGeometry:
    """An area a little larger: pieces that touch in a point would leave an open mesh."""
    return area.buffer(MERGED, join_style="mitre")


def discs(circles: tuple[Circle, ...], clearance: float = 0.0) -> BaseGeometry:
    """The area of circles."""
    return shapely.union_all(
        [
            shapely.Point(circle.centre).buffer(circle.diameter / 2 + clearance, quad_segs=_QUARTER)
            for circle in circles
        ]
    )


def unit_solid(unit: Unit, wanted: Fabrication) -> PrintedPart:
    """A unit with its id and arrow sunk into the underside, and with its tracking dots."""
    height, outline = unit.height, unit.outline
    written = sunk(unit.underside, unit.mark, outline, wanted)
    marks, dots = wanted.markers, discs(unit.markers)
    base = outline.difference(written)
    inset = wanted.print.first_layer_inset
    first = base.intersection(outline.buffer(-inset, join_style="mitre")) if inset else base
    split = min(wanted.print.layer, wanted.labels.depth)
    layers = [
        Layer(flat(first), 0.0, split),
        Layer(flat(base), split, wanted.labels.depth),
    ]
    if marks.kind == "recess":
        layers.append(Layer(outline, wanted.labels.depth, height - marks.depth))
        layers.append(Layer(flat(outline.difference(dots)), height - marks.depth, height))
    else:
        layers.append(Layer(outline, wanted.labels.depth, height))
    if marks.kind == "dots" and unit.markers:
        layers.append(Layer(flat(dots.intersection(outline)), height, height + marks.depth))
    return PrintedPart(unit.label, tuple(layer for layer in layers if layer.top > layer.bottom))


def sunk(letters: Strokes, mark: Strokes, outline: Polygon, wanted: Fabrication) -> BaseGeometry:
    """The area of a unit's underside where letters and a mark are sunk."""
    written = pen(letters, _pen_width(letters, wanted)).union(
        pen(mark, min(wanted.labels.stroke, 0.4))
    )
    rim = outline.buffer(-_RIM, join_style="mitre")  # also keeps nearly equal vertices apart
    return merged(shapely.set_precision(written.intersection(rim), _GRID))


def _pen_width(letters: Strokes, wanted: Fabrication) -> float:
    """Width of the strokes: thinner for smaller letters."""
    tall = shapely.total_bounds([LineString(stroke) for stroke in letters])
    least = min(tall[2] - tall[0], tall[3] - tall[1])
    return float(min(wanted.labels.stroke, max(0.3, 0.2 * least)))
