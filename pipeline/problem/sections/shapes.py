"""Describes shapes of a problem file: discs, rings, polygons, curves and images."""

from __future__ import annotations

import math
from itertools import accumulate
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Discriminator, Field, StringConstraints, Tag, ValidationInfo, model_validator
from pydantic.json_schema import SkipJsonSchema

from pipeline.problem.fields import (
    FOLDER,
    SIM_UNITS,
    Angle,
    Coordinate,
    File,
    Gap,
    Length,
    Section,
    exactly_one,
    fault,
)
from pipeline.problem.outlines import (
    FormulaError,
    Outline,
    Point,
    box_middle,
    compile_formula,
    extents,
    place_outline,
    read_outlines,
    turn_outline,
)
from pipeline.runtime import UserError


def _centre_tag(value: object) -> str:
    return "named" if isinstance(value, str) else "listed"


Centre = Annotated[
    Annotated[Literal["centre"], Tag("named")]
    | Annotated[tuple[Coordinate, Coordinate], Tag("listed")],
    Discriminator(_centre_tag),
]


def resolve_centre(centre: Centre, middle: Point) -> Point:
    """Returns a centre by its coordinates, mm."""
    return middle if isinstance(centre, str) else centre


class DiscShape(Section):
    """Points within a circle, the rim included.

    Attributes:
        centre: where it lies: the middle of the lattice, or [x, y] in the specimen's frame.
        radius: of the circle.
    """

    centre: Centre = "centre"
    radius: Length


class RingShape(Section):
    """Points between two circles, the outer rim included.

    Attributes:
        centre: where it lies: the middle of the lattice, or [x, y] in the specimen's frame.
        inner: radius of the inner circle.
        outer: radius of the outer circle.
    """

    centre: Centre = "centre"
    inner: Gap
    outer: Length


class PolygonShape(Section):
    """A polygon by its corners.

    Attributes:
        vertices: pairs [x, y] in the specimen's frame.
        orientation: by which it is turned about the middle of its box, counter-clockwise.
    """

    vertices: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=3)]
    orientation: Angle = 0.0

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """Draws the polygon in the specimen frame, mm."""
        del middle
        centre = box_middle(self.vertices)
        return (turn_outline(self.vertices, self.orientation, centre),)


class Heart(Section):
    """The authors' heart, x = 16 sin^3 t, y = 13 cos t - 5 cos 2t - 2 cos 3t - cos 4t.

    Attributes:
        kind: which of the curves this is.
        size: width and height to which it is scaled.
        centre: of the curve's own origin: the middle of the lattice, or [x, y].
        orientation: by which it is turned, counter-clockwise.
        points: corners of the polygon that stands for it.
    """

    kind: Literal["heart"]
    size: tuple[Length, Length]
    centre: Centre = "centre"
    orientation: Angle = 0.0
    points: Annotated[int, Field(ge=8, le=1000, strict=True)] = 50

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """Draws the curve in the specimen frame, mm."""
        turns = [2 * math.pi * k / (self.points - 1) for k in range(self.points)]
        curve = tuple((16 * math.sin(t) ** 3, _heart_height(t)) for t in turns)
        return (
            place_outline(
                curve, self.size, (0.0, 0.0), resolve_centre(self.centre, middle), self.orientation
            ),
        )


def _heart_height(t: float) -> float:
    return 13 * math.cos(t) - 5 * math.cos(2 * t) - 2 * math.cos(3 * t) - math.cos(4 * t)


class Smile(Section):
    """The authors' crescent between two lower half circles.

    Attributes:
        kind: which of the curves this is.
        centre: below the circles' centres: the middle of the lattice, or [x, y].
        inner_radius: of the upper edge.
        inner_rise: of its circle's centre above `centre`.
        outer_radius: of the lower edge.
        outer_rise: of its circle's centre above `centre`.
        orientation: by which it is turned, counter-clockwise.
    """

    kind: Literal["smile"]
    centre: Centre = "centre"
    inner_radius: Length
    inner_rise: Gap
    outer_radius: Length
    outer_rise: Gap
    orientation: Angle = 0.0

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """Draws the crescent in the specimen frame, mm."""
        step = 2 * math.pi / 40
        inner = [_on_circle(self.inner_radius, math.pi + k * step) for k in range(1, 20)]
        outer = [_on_circle(self.outer_radius, -k * step) for k in range(21)]
        curve = (
            *((x, y + self.inner_rise) for x, y in inner),
            *((x, y + self.outer_rise) for x, y in outer),
        )
        x0, y0 = resolve_centre(self.centre, middle)
        moved = tuple((x0 + x, y0 + y) for x, y in curve)
        return (turn_outline(moved, self.orientation, (x0, y0)),)


def _on_circle(radius: float, angle: float) -> Point:
    return radius * math.cos(angle), radius * math.sin(angle)


class Formula(Section):
    """The curve (x(t), y(t)), 0 <= t < 2 pi.

    Attributes:
        kind: which of the curves this is.
        x: formula in t, e.g. `16 * sin(t)^3`.
        y: likewise.
        size: width and height to which it is scaled.
        centre: of the curve's own origin: the middle of the lattice, or [x, y].
        orientation: by which it is turned, counter-clockwise.
        points: corners of the polygon that stands for it.
    """

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
            except FormulaError as error:
                raise fault(str(error), 'write e.g. "16 * sin(t)^3"', name) from error
            if max(values) == min(values):
                raise fault("the curve has no extent", "let the formula depend on t", name)
        return self

    def _along(self, text: str) -> list[float]:
        function = compile_formula(text)
        return [function(2 * math.pi * k / self.points) for k in range(self.points)]

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """Draws the curve in the specimen frame, mm."""
        curve = tuple(zip(self._along(self.x), self._along(self.y), strict=True))
        return (
            place_outline(
                curve, self.size, (0.0, 0.0), resolve_centre(self.centre, middle), self.orientation
            ),
        )


Curve = Annotated[Heart | Smile | Formula, Field(discriminator="kind")]


class Image(Section):
    """Dark part of a binary image (PNG, JPG) or of an SVG's fills, upright as one sees it.

    The outline is read from the file when the problem is.

    Attributes:
        file: as seen from the problem file.
        threshold: grey level, from 0 of black to 1 of white, below which a pixel or a fill is dark;
            without it an image of pixels must be binary.
        invert: whether the shape is light on a dark or a transparent ground.
        size: width and height to which the box around the shape is scaled; or `width`.
        width: to which it is scaled with its proportions kept; or `size`.
        centre: of the box: the middle of the lattice, or [x, y].
        orientation: by which it is turned, counter-clockwise.
    """

    file: File
    threshold: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    invert: bool = False
    size: tuple[Length, Length] | None = None
    width: Length | None = None
    centre: Centre = "centre"
    orientation: Angle = 0.0
    read: SkipJsonSchema[tuple[Outline, ...] | None] = None

    @model_validator(mode="after")
    def _with_outline(self, info: ValidationInfo) -> Image:
        exactly_one(self, "size", "width")
        if info.context == SIM_UNITS:
            return self
        if self.read is not None:
            raise fault("unknown key", "leave it out: the file is read anew each time", "read")

        folder = (info.context or {}).get(FOLDER, ".")
        try:
            outlines = read_outlines(
                Path(folder) / self.file, threshold=self.threshold, invert=self.invert
            )
        except UserError as error:
            raise fault(error.what, str(error.remedy), "file") from error
        return self.model_copy(update={"read": outlines})

    def outlines(self, middle: Point) -> tuple[Outline, ...]:
        """Draws the shape's outlines in the specimen frame, mm."""
        assert self.read is not None
        whole = tuple(point for outline in self.read for point in outline)
        width, height = extents(whole)
        size = self.size or (self.width or width, height * (self.width or width) / width)
        origin, centre = box_middle(whole), resolve_centre(self.centre, middle)
        scaled = place_outline(whole, size, origin, centre, self.orientation)
        ends = accumulate(len(outline) for outline in self.read)
        return tuple(
            scaled[end - len(outline) : end] for outline, end in zip(self.read, ends, strict=True)
        )
