"""Which units a selector or a region means, by arithmetic on the lattice sites.

Unit ids are `i + columns * j`; the site of unit (i, j) is `(i, j) * spacing` in the specimen frame.
The squares of the starting lattice are symmetric about their sites, so sites are their centroids.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from pipeline.problem.quantities import Angle, Length
from pipeline.problem.regions import HAIR, Region, inside
from pipeline.problem.section import Section

Index = Annotated[int, Field(ge=0, strict=True)]
Size = Annotated[int, Field(ge=1, le=1000, strict=True)]


class Lattice(Section):
    """Squares of alternating bias on a square lattice, joined by ligaments at their corners."""

    kind: Literal["quads"] = "quads"
    columns: Size
    rows: Size
    spacing: Length
    ligament_length: Length
    bias_angle: Angle

    @property
    def edge_length(self) -> float:
        """Edge of the starting squares in mm."""
        return (self.spacing - self.ligament_length) / math.sqrt(2.0) / math.cos(self.bias_angle)

    @property
    def centre_site(self) -> tuple[float, float]:
        """The site of the centre unit, or the middle of the lattice where there is none, in mm."""
        return self.spacing * (self.columns - 1) / 2, self.spacing * (self.rows - 1) / 2

    def unit(self, i: int, j: int) -> int:
        """The id of unit (i, j)."""
        return i + self.columns * j

    def sites(self) -> Iterator[tuple[int, float, float]]:
        """Every unit's id with the x and y of its site in mm, in the order of the ids."""
        for j in range(self.rows):
            for i in range(self.columns):
                yield self.unit(i, j), i * self.spacing, j * self.spacing

    def bonds(self) -> Iterator[tuple[int, int]]:
        """The units that each ligament joins."""
        for unit in range(self.columns * self.rows):
            if (unit + 1) % self.columns:
                yield unit, unit + 1
            if unit + self.columns < self.columns * self.rows:
                yield unit, unit + self.columns

    def name(self, unit: int) -> str:
        """A unit by its lattice indices."""
        j, i = divmod(unit, self.columns)
        return f"[{i}, {j}]"


class ListedUnits(Section):
    """Units by their lattice indices (i, j), counted from zero."""

    units: Annotated[tuple[tuple[Index, Index], ...], Field(min_length=1)]


def _selector_tag(value: object) -> str:
    return "listed" if isinstance(value, dict | ListedUnits) else "named"


NamedUnits = Literal["corners", "left", "right", "top", "bottom", "centre"]
Selector = Annotated[
    Annotated[NamedUnits, Tag("named")] | Annotated[ListedUnits, Tag("listed")],
    Discriminator(_selector_tag),
]


@lru_cache(maxsize=64)
def units_within(region: Region, lattice: Lattice) -> tuple[int, ...]:
    """The ids of the units whose site lies in the region, ascending."""
    units, points = zip(*((unit, (x, y)) for unit, x, y in lattice.sites()), strict=True)
    held = region.holds(points, lattice.centre_site, HAIR * lattice.spacing)
    return tuple(unit for unit, within in zip(units, held, strict=True) if within)


@lru_cache(maxsize=64)
def units_near(region: Region, distance: float, lattice: Lattice) -> tuple[int, ...]:
    """The ids of the units in the region or within `distance` (mm) of its outline, ascending."""
    units, points = zip(*((unit, (x, y)) for unit, x, y in lattice.sites()), strict=True)
    reach = distance + HAIR * lattice.spacing
    held = inside(points, region.outlines(lattice.centre_site), reach)
    return tuple(unit for unit, near in zip(units, held, strict=True) if near)


@lru_cache(maxsize=16)
def loose_units(lattice: Lattice, removed: frozenset[int]) -> tuple[int, ...]:
    """The ids of the units that are cut off from the largest part, ascending."""
    neighbours: dict[int, list[int]] = {
        unit: [] for unit, _, _ in lattice.sites() if unit not in removed
    }
    for one, other in lattice.bonds():
        if one in neighbours and other in neighbours:
            neighbours[one].append(other)
            neighbours[other].append(one)
    parts: list[set[int]] = []
    for unit in neighbours:
        if not any(unit in part for part in parts):
            parts.append(_joined_to(unit, neighbours))
    largest = max(parts, key=len, default=set())
    return tuple(unit for unit in neighbours if unit not in largest)


def _joined_to(start: int, neighbours: dict[int, list[int]]) -> set[int]:
    """The units that ligaments join to `start`, at any distance."""
    found, waiting = {start}, [start]
    while waiting:
        new = set(neighbours[waiting.pop()]) - found
        found |= new
        waiting += new
    return found


def selected_units(selector: Selector, lattice: Lattice) -> tuple[int, ...]:
    """The ids that a selector means, ascending; listed units must lie in the lattice.

    Raises:
        IndexError: a listed unit is not in the lattice, or there is no one centre unit.
    """
    if isinstance(selector, ListedUnits):
        return tuple(sorted({_listed(i, j, lattice) for i, j in selector.units}))
    if selector == "centre":
        return (_centre_unit(lattice),)
    columns, rows = range(lattice.columns), range(lattice.rows)
    sides = {
        "corners": (columns[:: max(columns[-1], 1)], rows[:: max(rows[-1], 1)]),
        "left": (columns[:1], rows),
        "right": (columns[-1:], rows),
        "bottom": (columns, rows[:1]),
        "top": (columns, rows[-1:]),
    }
    chosen_columns, chosen_rows = sides[selector]
    return tuple(lattice.unit(i, j) for j in chosen_rows for i in chosen_columns)


def _listed(i: int, j: int, lattice: Lattice) -> int:
    if i >= lattice.columns or j >= lattice.rows:
        raise IndexError(f"unit [{i}, {j}] is not in the lattice")
    return lattice.unit(i, j)


def _centre_unit(lattice: Lattice) -> int:
    if lattice.columns % 2 == 0 or lattice.rows % 2 == 0:
        raise IndexError("a lattice of even size has no centre unit")
    return lattice.unit(lattice.columns // 2, lattice.rows // 2)
