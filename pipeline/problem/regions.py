"""Regions of the specimen: discs, rings, polygons and parametric curves, and what lies in them.

A region is a set of points of the specimen frame (mm); a unit belongs to it if its site does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from pipeline.problem.quantities import Angle, Coordinate, Gap, Length
from pipeline.problem.section import Section, exactly_one

HAIR = 1e-9  # relative; keeps points that lie on a rim on its inner side

Point = tuple[float, float]
Outline = tuple[Point, ...]


def _centre_tag(value: object) -> str:
    return "named" if isinstance(value, str) else "listed"


Centre = Annotated[
    Annotated[Literal["centre"], Tag("named")]
    | Annotated[tuple[Coordinate, Coordinate], Tag("listed")],
    Discriminator(_centre_tag),
]


class Disc(Section):
    """Points within `radius` of `centre`, the rim included."""

    centre: Centre = "centre"
    radius: Length


class Ring(Section):
    """Points beyond `inner` and within `outer` of `centre`."""

    centre: Centre = "centre"
    inner: Gap
    outer: Length


class Polygon(Section):
    """A polygon by its corners in the specimen frame, turned about the middle of its box."""

    vertices: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=3)]
    orientation: Angle = 0.0

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """The polygon in the specimen frame, mm."""
        del middle
        centre = box_middle(self.vertices)
        return (turned(self.vertices, self.orientation, centre),)


class Heart(Section):
    """The authors' heart, x = 16 sin^3 t, y = 13 cos t - 5 cos 2t - 2 cos 3t - cos 4t.

    Its extents are scaled to `size`; the curve's own origin comes to lie at `centre`.
    """

    kind: Literal["heart"]
    size: tuple[Length, Length]
    centre: Centre = "centre"
    orientation: Angle = 0.0
    points: Annotated[int, Field(ge=8, le=1000, strict=True)] = 50

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """The curve in the specimen frame, mm."""
        turns = [2 * math.pi * k / (self.points - 1) for k in range(self.points)]
        curve = tuple((16 * math.sin(t) ** 3, _heart_height(t)) for t in turns)
        return (placed(curve, self.size, (0.0, 0.0), at(self.centre, middle), self.orientation),)


def _heart_height(t: float) -> float:
    return 13 * math.cos(t) - 5 * math.cos(2 * t) - 2 * math.cos(3 * t) - math.cos(4 * t)


class Smile(Section):
    """The authors' crescent between two lower half circles whose centres lie above `centre`."""

    kind: Literal["smile"]
    centre: Centre = "centre"
    inner_radius: Length
    inner_rise: Gap
    outer_radius: Length
    outer_rise: Gap
    orientation: Angle = 0.0

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """The crescent in the specimen frame, mm."""
        step = 2 * math.pi / 40
        inner = [_on_circle(self.inner_radius, math.pi + k * step) for k in range(1, 20)]
        outer = [_on_circle(self.outer_radius, -k * step) for k in range(21)]
        curve = (
            *((x, y + self.inner_rise) for x, y in inner),
            *((x, y + self.outer_rise) for x, y in outer),
        )
        x0, y0 = at(self.centre, middle)
        moved = tuple((x0 + x, y0 + y) for x, y in curve)
        return (turned(moved, self.orientation, (x0, y0)),)


def _on_circle(radius: float, angle: float) -> Point:
    return radius * math.cos(angle), radius * math.sin(angle)


Curve = Annotated[Heart | Smile, Field(discriminator="kind")]


class Region(Section):
    """A part of the specimen's plane."""

    disc: Disc | None = None
    ring: Ring | None = None
    polygon: Polygon | None = None
    curve: Curve | None = None

    @model_validator(mode="after")
    def _one_shape(self) -> Region:
        exactly_one(self, "disc", "ring", "polygon", "curve")
        return self

    @property
    def bounds(self) -> tuple[Centre, float, float] | None:
        """Centre, inner radius (-1 for a disc, which holds its own centre) and outer radius, mm.

        None for regions that are not round.
        """
        if self.ring is not None:
            return self.ring.centre, self.ring.inner, self.ring.outer
        if self.disc is not None:
            return self.disc.centre, -1.0, self.disc.radius
        return None

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """Closed outlines, mm; a point within an odd number of them lies in the region.

        Args:
            middle: of the lattice, for shapes that are centred there.
        """
        shape = self.polygon or self.curve
        return () if shape is None else shape.outlines(middle)

    def membership(self, middle: Point, hair: float) -> Callable[[Point], bool]:
        """The test whether a point (mm) lies in the region, or within `hair` of its outer rim."""
        if self.bounds is not None:
            named, inner, outer = self.bounds
            centre = at(named, middle)
            return lambda point: inner + hair < math.dist(point, centre) <= outer + hair
        outlines = self.outlines(middle)
        return lambda point: inside(point, outlines, hair)


def at(centre: Centre, middle: Point) -> Point:
    """A centre by its coordinates, mm."""
    return middle if isinstance(centre, str) else centre


def inside(point: Point, outlines: tuple[Outline, ...], hair: float) -> bool:
    """Whether a point lies within an odd number of closed outlines, or within `hair` of one."""
    odd = False
    x, y = point
    for outline in outlines:
        for (x1, y1), (x2, y2) in zip(outline, (*outline[1:], outline[0]), strict=True):
            if _distance(point, (x1, y1), (x2, y2)) <= hair:
                return True
            if (y1 > y) != (y2 > y) and x < x1 + (y - y1) * (x2 - x1) / (y2 - y1):
                odd = not odd
    return odd


def _distance(point: Point, start: Point, end: Point) -> float:
    """Distance of a point from a segment."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = (point[0] - start[0]) * dx + (point[1] - start[1]) * dy
    share = min(1.0, max(0.0, along / max(dx * dx + dy * dy, 1e-300)))
    return math.dist(point, (start[0] + share * dx, start[1] + share * dy))


def placed(
    outline: Outline, size: tuple[float, float], origin: Point, centre: Point, orientation: float
) -> Outline:
    """An outline whose box is scaled to `size`, with `origin` at `centre`, turned about it."""
    extents = [max(axis) - min(axis) for axis in zip(*outline, strict=True)]
    scale_x, scale_y = (wanted / has for wanted, has in zip(size, extents, strict=True))
    moved = tuple(
        (centre[0] + scale_x * (x - origin[0]), centre[1] + scale_y * (y - origin[1]))
        for x, y in outline
    )
    return turned(moved, orientation, centre)


def turned(outline: Outline, angle: float, centre: Point) -> Outline:
    """An outline turned by `angle` (rad) about `centre`."""
    cosine, sine = math.cos(angle), math.sin(angle)
    arms = ((x - centre[0], y - centre[1]) for x, y in outline)
    return tuple(
        (centre[0] + cosine * x - sine * y, centre[1] + sine * x + cosine * y) for x, y in arms
    )


def box_middle(outline: Outline) -> Point:
    """The middle of an outline's box."""
    (x1, x2), (y1, y2) = ((min(axis), max(axis)) for axis in zip(*outline, strict=True))
    return (x1 + x2) / 2, (y1 + y2) / 2
