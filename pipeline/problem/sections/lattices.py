"""Describes lattices: polygons in columns and rows, and networks read from a file.

A unit's site is the centroid of its starting polygon, which for squares is their lattice point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import SkipJsonSchema

from pipeline.problem.fields import (
    FOLDER,
    SIM_UNITS,
    Angle,
    Coordinate,
    File,
    Length,
    Section,
    fault,
)
from pipeline.problem.outlines import NetworkContent, Stiffness, read_network
from pipeline.runtime import UserError
from sim.structure import honeycomb, kagome, listed, quads, triangular

if TYPE_CHECKING:
    from sim.structure import Lattice as Network

Size = Annotated[int, Field(ge=1, le=1000, strict=True)]
Point = tuple[float, float]


class _Grid(Section):
    """Units in columns and rows: unit (i, j) has the id `i + across * j`.

    Attributes:
        kind: which of the lattices this is.
        columns: of units, or of cells with two units each (kagome).
        rows: likewise.
        spacing: of the units, or of the cells.
        ligament_length: from unit to unit, where a ligament joins them.
    """

    columns: Size
    rows: Size
    spacing: Length
    ligament_length: Length

    @property
    def across(self) -> int:
        """Number of units in a row."""
        return self.columns

    @property
    def n_units(self) -> int:
        """Number of units."""
        return self.across * self.rows

    def unit(self, i: int, j: int) -> int:
        """Returns the id of unit (i, j).

        Raises:
            IndexError: it is not in the lattice.
        """
        if i >= self.across or j >= self.rows:
            raise IndexError(f"unit [{i}, {j}] is not in the lattice")
        return i + self.across * j

    def name(self, unit: int) -> str:
        """Names a unit by its lattice indices."""
        j, i = divmod(unit, self.across)
        return f"[{i}, {j}]"

    @property
    def extent(self) -> str:
        """Tells the range of the indices, in words."""
        return f"i runs to {self.across - 1} and j to {self.rows - 1}, from zero"

    def side(self, name: str) -> tuple[int, ...]:
        """Lists the units along a side or at the corners, ascending."""
        deep = self.across // self.columns
        every, rows = range(self.across), range(self.rows)
        ends, caps = sorted({*every[:deep], *every[-deep:]}), sorted({rows[0], rows[-1]})
        sides = {
            "corners": (ends, caps),
            "left": (every[:deep], rows),
            "right": (every[-deep:], rows),
            "bottom": (every, rows[:1]),
            "top": (every, rows[-1:]),
        }
        chosen, along = sides[name]
        return tuple(self.unit(i, j) for j in along for i in chosen)


class Regular(_Grid):
    """Regular polygons, a corner towards each neighbour."""

    corners: ClassVar[int]

    @property
    def bias(self) -> float:
        """Angle by which the units are turned, left and right by turns, rad."""
        return float(getattr(self, "bias_angle", 0.0))

    @property
    def edge_length(self) -> float:
        """Edge of the starting units in mm."""
        reach = (self.spacing - self.ligament_length) / math.cos(self.bias)
        return reach * math.sin(math.pi / self.corners)

    @property
    def block_angle(self) -> float:
        """Angle at the corners of the starting units, deg."""
        return 180.0 - 360.0 / self.corners

    @property
    def void_angle(self) -> float:
        """Smallest angle between the edges of neighbours at the start, deg."""
        return 180.0 - self.block_angle - 2.0 * abs(math.degrees(self.bias))


class Quads(Regular):
    """Squares of alternating bias on a square lattice, joined by ligaments at their corners.

    Attributes:
        bias_angle: by which the squares are turned: those of even i + j clockwise, the others
            counter-clockwise.
    """

    corners: ClassVar[int] = 4
    kind: Literal["quads"] = "quads"
    bias_angle: Angle

    @property
    def centre_site(self) -> Point:
        """Returns the site of the centre unit in mm, or the middle of the lattice without one."""
        return self.spacing * (self.columns - 1) / 2, self.spacing * (self.rows - 1) / 2

    def sites(self) -> Iterator[tuple[int, float, float]]:
        """Lists every unit's id with the x and y of its site in mm, in the order of the ids."""
        for j in range(self.rows):
            for i in range(self.columns):
                yield self.unit(i, j), i * self.spacing, j * self.spacing

    def bonds(self) -> Iterator[tuple[int, int]]:
        """Lists the units that each ligament joins."""
        for unit in range(self.n_units):
            if (unit + 1) % self.columns:
                yield unit, unit + 1
            if unit + self.columns < self.n_units:
                yield unit, unit + self.columns

    def network(self) -> Network:
        """Builds the lattice for sim/."""
        return quads(self.columns, self.rows, self.spacing, self.ligament_length, self.bias_angle)


class _WithNetwork(Section):
    """Takes sites and bonds from the network for sim/."""

    def network(self) -> Network:
        """Builds the lattice for sim/."""
        raise NotImplementedError

    def sites(self) -> Iterator[tuple[int, float, float]]:
        """Lists every unit's id with the x and y of its site in mm, in the order of the ids."""
        return iter([(unit, x, y) for unit, (x, y) in enumerate(_network(self).site.tolist())])

    def bonds(self) -> Iterator[tuple[int, int]]:
        """Lists the units that each ligament joins."""
        return iter([(one, other) for one, other in _network(self).ligament_units.tolist()])

    @property
    def least_void(self) -> float:
        """Finds the smallest void angle at rest, in deg; infinite where there is no ligament."""
        return math.degrees(_network(self).resting_voids.min(initial=math.inf))

    @property
    def centre_site(self) -> Point:
        """Returns the middle of the box around the sites, in mm."""
        _, x, y = zip(*self.sites(), strict=True)
        return (min(x) + max(x)) / 2, (min(y) + max(y)) / 2


@lru_cache(maxsize=8)
def _network(lattice: _WithNetwork) -> Network:
    return lattice.network()


class Honeycomb(_WithNetwork, Regular):
    """Triangles of alternating bias on a honeycomb, each joined to three others.

    Rows are zigzags along x; the units of even i + j are joined to the row above.

    Attributes:
        bias_angle: by which the triangles are turned: those of even i + j clockwise, the others
            counter-clockwise.
    """

    corners: ClassVar[int] = 3
    kind: Annotated[Literal["honeycomb", "hexagonal"], AfterValidator(lambda _: "honeycomb")]
    bias_angle: Angle = 0.0

    def network(self) -> Network:
        """Builds the lattice for sim/."""
        return honeycomb(
            self.columns, self.rows, self.spacing, self.ligament_length, self.bias_angle
        )


class Triangular(_WithNetwork, Regular):
    """Hexagons on a triangular lattice, each joined to six others.

    Every other row, from the second on, is shifted by half a spacing.
    """

    corners: ClassVar[int] = 6
    kind: Literal["triangular"]

    def network(self) -> Network:
        """Builds the lattice for sim/."""
        return triangular(self.columns, self.rows, self.spacing, self.ligament_length)


class Kagome(_WithNetwork, _Grid):
    """Two triangles in every cell, (2 i, j) and (2 i + 1, j), joined at three corners.

    Attributes:
        bias: by which the joints of even and of odd cells are moved up and down.
        cell_angle: between the sides of a cell: 60 deg in the regular kagome lattice, 90 deg as
            the authors take it.
    """

    kind: Literal["kagome"]
    bias: Coordinate
    cell_angle: Angle = math.pi / 2

    @property
    def across(self) -> int:
        """Number of units in a row."""
        return 2 * self.columns

    @property
    def centre_site(self) -> Point:
        """Returns the middle of the cells, in mm."""
        up = self.rows * self.spacing / 2
        along = self.columns * self.spacing / 2
        return along + up * math.cos(self.cell_angle), up * math.sin(self.cell_angle)

    def network(self) -> Network:
        """Builds the lattice for sim/."""
        return kagome(
            self.columns, self.rows, self.spacing, self.ligament_length, self.bias, self.cell_angle
        )


class ListedNetwork(_WithNetwork):
    """Polygons and ligaments from a file: CSV, netCDF, or closed polylines and lines of a DXF.

    Units are listed as [number, 0]: by their numbers in a CSV, which count from 0 without gaps, and
    by the order in other files. Polylines that end where they begin are closed; none has arcs.

    Attributes:
        kind: which of the lattices this is.
        file: as seen from the problem file; lengths in it are mm.
        spacing: the length that makes displacements comparable with rotations, about the distance
            of neighbouring units.
    """

    kind: Literal["file"]
    file: File
    spacing: Length
    polygons: SkipJsonSchema[tuple[tuple[Point, ...], ...] | None] = None
    ligaments: SkipJsonSchema[tuple[tuple[Point, Point], ...] | None] = None
    stiffnesses: SkipJsonSchema[tuple[Stiffness, ...] | None] = None

    @model_validator(mode="after")
    def _with_content(self, info: ValidationInfo) -> Self:
        if info.context == SIM_UNITS:
            return self
        for name in NetworkContent._fields:
            if getattr(self, name) is not None:
                raise fault("unknown key", "leave it out: they are read from the file", name)

        folder = (info.context or {}).get(FOLDER, ".")
        try:
            content = read_network(Path(folder) / self.file)
            made = self.model_copy(update=content._asdict())
            made.network()
        except UserError as error:
            raise fault(error.what, str(error.remedy), "file") from error
        except ValueError as error:
            remedy = "list every unit once, and once every ligament from corner to corner of two"
            raise fault(str(error), remedy, "file") from error
        return made

    @property
    def columns(self) -> int:
        """Number of units."""
        return len(self.polygons or ())

    @property
    def rows(self) -> int:
        """Returns one: the units are listed one after the other."""
        return 1

    @property
    def n_units(self) -> int:
        """Number of units."""
        return self.columns

    @property
    def ligament_length(self) -> float:
        """Mean length of the ligaments in mm."""
        lengths = [math.dist(*ends) for ends in self.ligaments or ()]
        return math.fsum(lengths) / max(len(lengths), 1)

    @property
    def extent(self) -> str:
        """Tells the range of the indices, in words."""
        return f"i runs to {self.n_units - 1} and j is 0"

    def unit(self, i: int, j: int) -> int:
        """Returns the id of unit (i, 0).

        Raises:
            IndexError: it is not in the lattice.
        """
        if i >= self.n_units or j > 0:
            raise IndexError(f"unit [{i}, {j}] is not in the lattice")
        return i

    def name(self, unit: int) -> str:
        """Names a unit by its number."""
        return f"[{unit}, 0]"

    def side(self, name: str) -> tuple[int, ...]:
        """Lists units within half a spacing of a side's outermost site, or both ways at corners."""
        every = list(self.sites())
        x, y = [x for _, x, _ in every], [y for _, _, y in every]
        near = self.spacing / 2
        sides = {
            "left": {u for u, a, _ in every if a <= min(x) + near},
            "right": {u for u, a, _ in every if a >= max(x) - near},
            "bottom": {u for u, _, b in every if b <= min(y) + near},
            "top": {u for u, _, b in every if b >= max(y) - near},
        }
        sides["corners"] = (sides["left"] | sides["right"]) & (sides["bottom"] | sides["top"])
        return tuple(sorted(sides[name]))

    def network(self) -> Network:
        """Builds the lattice for sim/.

        Raises:
            ValueError: a polygon without area, or a ligament that does not join two units.
        """
        return listed(self.polygons or (), self.ligaments or (), self.spacing)


def _kind(value: object) -> str:
    named = value.get("kind", "quads") if isinstance(value, dict) else getattr(value, "kind", "")
    return "honeycomb" if named == "hexagonal" else str(named)


Lattice = Annotated[
    Annotated[Quads, Tag("quads")]
    | Annotated[Kagome, Tag("kagome")]
    | Annotated[Honeycomb, Tag("honeycomb")]
    | Annotated[Triangular, Tag("triangular")]
    | Annotated[ListedNetwork, Tag("file")],
    Discriminator(_kind),
]
