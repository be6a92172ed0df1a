"""Describes regions of the specimen.

A region is a set of points of the specimen frame (mm); a unit belongs to it if its site does.
"""

import math
from collections.abc import Sequence
from typing import ClassVar, Literal, Self

from pydantic import model_validator

from pipeline.problem.fields import Length, Section, exactly_one
from pipeline.problem.outlines import Outline, Point, find_inside
from pipeline.problem.sections.shapes import (
    Centre,
    Curve,
    DiscShape,
    Image,
    PolygonShape,
    RingShape,
    resolve_centre,
)

HAIR = 1e-9  # relative; keeps points that lie on a rim on its inner side

ROUND = 360  # corners that stand for a circle


class Region(Section):
    """A part of the specimen's plane, by one shape.

    Attributes:
        disc: all within a circle.
        ring: all between two circles.
        polygon: by its corners.
        curve: a heart, a smile, or a formula.
        image: what is dark in a picture, or filled in a drawing.
    """

    shapes: ClassVar[tuple[str, ...]] = ("disc", "ring", "polygon", "curve", "image")

    disc: DiscShape | None = None
    ring: RingShape | None = None
    polygon: PolygonShape | None = None
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
        """Draws closed outlines, mm; a point within an odd number of them lies in the region.

        Some shapes are centred in the `middle` of the lattice.
        """
        if self.bounds is not None:
            centre, _, radius = self.bounds
            x, y = resolve_centre(centre, middle)
            steps = (2 * math.pi * k / ROUND for k in range(ROUND))
            return (tuple((x + radius * math.cos(a), y + radius * math.sin(a)) for a in steps),)
        shape = self.polygon or self.curve or self.image
        return () if shape is None else shape.outlines(middle)

    def holds(self, points: Sequence[Point], middle: Point, hair: float) -> list[bool]:
        """Tells which points (mm) lie in the region, or within `hair` of its outer rim."""
        if self.bounds is not None:
            named, inner, outer = self.bounds
            centre = resolve_centre(named, middle)
            return [inner + hair < math.dist(point, centre) <= outer + hair for point in points]
        return find_inside(points, self.outlines(middle), hair)


class VoidRegion(Region):
    """Region that is cut out.

    Attributes:
        loose: what to do where units are cut off from the rest: refuse, or remove them as well.
    """

    loose: Literal["refuse", "remove"] = "refuse"


class Around(Section):
    """Points near the void, the inclusion, or the region of interest.

    Attributes:
        distance: from it, at most.
    """

    distance: Length


class CloakRegion(Region):
    """Units that may be redesigned: those of a region, or all around something.

    Attributes:
        around: all near the void, the inclusion, or the region of interest.
    """

    shapes: ClassVar[tuple[str, ...]] = (*Region.shapes, "around")

    around: Around | None = None
