"""Selects units by name, list or region, by arithmetic on the lattice sites."""

import math
from functools import lru_cache
from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from pipeline.problem.fields import Section
from pipeline.problem.outlines import find_inside
from pipeline.problem.sections.lattices import Lattice, Quads
from pipeline.problem.sections.regions import HAIR, Region

Index = Annotated[int, Field(ge=0, strict=True)]


class ListedUnits(Section):
    """Units one by one.

    Attributes:
        units: pairs [i, j] of column and row, counted from zero.
    """

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
    """Lists the ids of the units whose site lies in the region, ascending."""
    units, points = zip(*((unit, (x, y)) for unit, x, y in lattice.sites()), strict=True)
    held = region.holds(points, lattice.centre_site, HAIR * lattice.spacing)
    return tuple(unit for unit, within in zip(units, held, strict=True) if within)


@lru_cache(maxsize=64)
def units_near(region: Region, distance: float, lattice: Lattice) -> tuple[int, ...]:
    """Lists the ids of units in the region or within `distance` (mm) of its outline, ascending."""
    units, points = zip(*((unit, (x, y)) for unit, x, y in lattice.sites()), strict=True)
    reach = distance + HAIR * lattice.spacing
    held = find_inside(points, region.outlines(lattice.centre_site), reach)
    return tuple(unit for unit, near in zip(units, held, strict=True) if near)


@lru_cache(maxsize=16)
def loose_units(lattice: Lattice, removed: frozenset[int]) -> tuple[int, ...]:
    """Lists the ids of the units that are cut off from the largest part, ascending."""
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
    """Finds the units that ligaments join to `start`, at any distance."""
    found, waiting = {start}, [start]
    while waiting:
        new = set(neighbours[waiting.pop()]) - found
        found |= new
        waiting += new
    return found


def selected_units(selector: Selector, lattice: Lattice) -> tuple[int, ...]:
    """Lists the ids that a selector means, ascending; listed units must lie in the lattice.

    Raises:
        IndexError: a listed unit is not in the lattice, or there is no one centre unit.
    """
    if isinstance(selector, ListedUnits):
        return tuple(sorted({lattice.unit(i, j) for i, j in selector.units}))
    return (_centre_unit(lattice),) if selector == "centre" else lattice.side(selector)


def _centre_unit(lattice: Lattice) -> int:
    centre, hair = lattice.centre_site, HAIR * lattice.spacing
    for unit, x, y in lattice.sites():
        if math.dist((x, y), centre) <= hair:
            return unit
    if isinstance(lattice, Quads):
        raise IndexError("a lattice of even size has no centre unit")
    raise IndexError("no unit has its site at the middle of the lattice")
