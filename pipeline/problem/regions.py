"""Regions of the specimen: discs, rings, polygons, curves and images, and what lies in them.

A region is a set of points of the specimen frame (mm); a unit belongs to it if its site does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import (
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import SkipJsonSchema

from pipeline.problem import formula
from pipeline.problem.quantities import (
    FOLDER,
    SIM_UNITS,
    Angle,
    Coordinate,
    Gap,
    Length,
    fault,
)
from pipeline.problem.section import Section, exactly_one

HAIR = 1e-9  # relative; keeps points that lie on a rim on its inner side

ROUND = 360  # corners that stand for a circle

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


class Formula(Section):
    """The curve (x(t), y(t)), 0 <= t < 2 pi; its extents are scaled to `size`, its origin moved."""

    kind: Literal["formula"]
    x: Annotated[str, StringConstraints(min_length=1)]
    y: Annotated[str, StringConstraints(min_length=1)]
    size: tuple[Length, Length]
    centre: Centre = "centre"
    orientation: Angle = 0.0
    points: Annotated[int, Field(ge=8, le=1000, strict=True)] = 100

    @model_validator(mode="after")
    def _understood(self) -> Formula:
        for name in ("x", "y"):
            try:
                values = self._along(getattr(self, name))
            except formula.FormulaError as error:
                raise fault(str(error), 'write e.g. "16 * sin(t)^3"', name) from error
            if max(values) == min(values):
                raise fault("the curve has no extent", "let the formula depend on t", name)
        return self

    def _along(self, text: str) -> list[float]:
        function = formula.compiled(text)
        return [function(2 * math.pi * k / self.points) for k in range(self.points)]

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """The curve in the specimen frame, mm."""
        curve = tuple(zip(self._along(self.x), self._along(self.y), strict=True))
        return (placed(curve, self.size, (0.0, 0.0), at(self.centre, middle), self.orientation),)


Curve = Annotated[Heart | Smile | Formula, Field(discriminator="kind")]


class Image(Section):
    """What is dark in a binary image (PNG, JPG) or filled in an SVG, upright as one sees it.

    The box around the shape is scaled to `size`, or to `width` with its proportions kept, and its
    middle moved to `centre`. The outline is read from the file when the problem is.
    """

    file: Annotated[str, StringConstraints(min_length=1)]
    size: tuple[Length, Length] | None = None
    width: Length | None = None
    centre: Centre = "centre"
    orientation: Angle = 0.0
    read: tuple[Outline, ...] | SkipJsonSchema[None] = None

    @model_validator(mode="after")
    def _with_outline(self, info: ValidationInfo) -> Image:
        exactly_one(self, "size", "width")
        if info.context == SIM_UNITS:
            return self
        if self.read is not None:
            raise fault("unknown key", "leave it out: the file is read anew each time", "read")
        from pipeline.problem.images import ImageError, read_outlines

        folder = (info.context or {}).get(FOLDER, ".")
        try:
            outlines = read_outlines(Path(folder) / self.file)
        except ImageError as error:
            raise fault(error.what, error.remedy, "file") from error
        return self.model_copy(update={"read": outlines})

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """The shape's outlines in the specimen frame, mm."""
        assert self.read is not None
        whole = tuple(point for outline in self.read for point in outline)
        width, height = extents(whole)
        size = self.size or (self.width or width, height * (self.width or width) / width)
        origin, centre = box_middle(whole), at(self.centre, middle)
        scaled = placed(whole, size, origin, centre, self.orientation)
        ends = accumulate(len(outline) for outline in self.read)
        return tuple(
            scaled[end - len(outline) : end] for outline, end in zip(self.read, ends, strict=True)
        )


class Region(Section):
    """A part of the specimen's plane."""

    shapes: ClassVar[tuple[str, ...]] = ("disc", "ring", "polygon", "curve", "image")

    disc: Disc | None = None
    ring: Ring | None = None
    polygon: Polygon | None = None
    curve: Curve | None = None
    image: Image | None = None

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        exactly_one(self, *self.shapes)
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
        if self.bounds is not None:
            centre, _, radius = self.bounds
            x, y = at(centre, middle)
            steps = (2 * math.pi * k / ROUND for k in range(ROUND))
            return (tuple((x + radius * math.cos(a), y + radius * math.sin(a)) for a in steps),)
        shape = self.polygon or self.curve or self.image
        return () if shape is None else shape.outlines(middle)

    def holds(self, points: Sequence[Point], middle: Point, hair: float) -> list[bool]:
        """Which points (mm) lie in the region, or within `hair` of its outer rim."""
        if self.bounds is not None:
            named, inner, outer = self.bounds
            centre = at(named, middle)
            return [inner + hair < math.dist(point, centre) <= outer + hair for point in points]
        return inside(points, self.outlines(middle), hair)


class VoidRegion(Region):
    """What is cut out; units that it cuts off from the rest are refused, or removed as well."""

    loose: Literal["refuse", "remove"] = "refuse"


class Around(Section):
    """Points within `distance` of the void, the inclusion, or the region of interest."""

    distance: Length


class CloakRegion(Region):
    """Where units may be redesigned."""

    shapes: ClassVar[tuple[str, ...]] = (*Region.shapes, "around")

    around: Around | None = None


def at(centre: Centre, middle: Point) -> Point:
    """A centre by its coordinates, mm."""
    return middle if isinstance(centre, str) else centre


def inside(points: Sequence[Point], outlines: tuple[Outline, ...], hair: float) -> list[bool]:
    """Which points lie within an odd number of closed outlines, or within `hair` of one."""
    import numpy as np

    px, py = np.array(points, dtype=float).reshape(-1, 2).T[..., None]
    odd, near = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for outline in outlines:
        start = np.array(outline)
        (x1, y1), (x2, y2) = start.T, np.roll(start, -1, axis=0).T
        dx, dy = x2 - x1, y2 - y1
        along = ((px - x1) * dx + (py - y1) * dy) / np.maximum(dx * dx + dy * dy, 1e-300)
        share = np.clip(along, 0.0, 1.0)
        near |= (np.hypot(px - x1 - share * dx, py - y1 - share * dy) <= hair).any(axis=1)
        crossed = (y1 > py) != (y2 > py)
        ahead = px < x1 + (py - y1) * dx / np.where(dy == 0.0, 1.0, dy)
        odd ^= np.count_nonzero(crossed & ahead, axis=1) % 2 == 1
    found: list[bool] = (odd | near).tolist()
    return found


def placed(
    outline: Outline, size: tuple[float, float], origin: Point, centre: Point, orientation: float
) -> Outline:
    """An outline whose box is scaled to `size`, with `origin` at `centre`, turned about it."""
    scale_x, scale_y = (wanted / has for wanted, has in zip(size, extents(outline), strict=True))
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


def extents(outline: Outline) -> tuple[float, float]:
    """Width and height of an outline's box."""
    width, height = (max(axis) - min(axis) for axis in zip(*outline, strict=True))
    return width, height


def box_middle(outline: Outline) -> Point:
    """The middle of an outline's box."""
    (x1, x2), (y1, y2) = ((min(axis), max(axis)) for axis in zip(*outline, strict=True))
    return (x1 + x2) / 2, (y1 + y2) / 2
