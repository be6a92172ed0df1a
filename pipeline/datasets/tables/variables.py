"""Defines variables of a dataset (dims, unit, meaning) and those that several share.

Coordinates are those of the specimen frame: origin at the lattice point of unit (0, 0), x to the
right, y up, rotations counter-clockwise; `unit` carries the design's ids.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Type = Literal["float64", "float32", "int64", "int8", "str"]


@dataclass(frozen=True)
class Variable:
    """Describes one variable of a dataset.

    Attributes:
        dims: names of its dimensions.
        units: its unit as UDUNITS spells it, "1" for names, ids, ratios and pixels; where its
            components differ, each unit with them in brackets.
        long_name: what it is, for people and axes.
        dtype: type in the file.
        gaps: whether NaN is a value it may take (padding, free degrees of freedom, failed cases).
        flags: meanings of its integer values.
        values: all values of a coordinate, in their order.
        subset: whether it may have some of them only.
        also: units of equal right, where the quantity depends on the problem.
        coordinate: whether it labels dimensions.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: Type = "float64"
    gaps: bool = False
    flags: Mapping[str, int] = field(default_factory=dict)
    values: tuple[str, ...] = ()
    subset: bool = False
    also: tuple[str, ...] = ()
    coordinate: bool = False

    @property
    def unit_attribute(self) -> str:
        """Names the attribute of the unit: no `units` of CF's holds for components that differ."""
        return "component_units" if "(" in self.units else "units"


Table = dict[str, Variable]


def label(dims: tuple[str, ...], units: str, long_name: str, dtype: Type = "float64") -> Variable:
    """Describes a coordinate."""
    return Variable(dims, units, long_name, dtype, coordinate=True)


def names(dim: str, long_name: str, *values: str) -> Variable:
    """Describes a coordinate of names; where some are given, of these in their order."""
    return Variable((dim,), "1", long_name, "str", values=values, coordinate=True)


UNIT: Table = {
    "unit": label(("unit",), "1", "id of the unit, i + columns j", "int64"),
    "i": label(("unit",), "1", "column of the unit", "int64"),
    "j": label(("unit",), "1", "row of the unit", "int64"),
    "xy": names("xy", "axis of the specimen frame", "x", "y"),
}

CASE: Table = {"direction": label(("case",), "degree", "direction of the drive")}

ENERGY = ("N mm",)
"""Unit of a loss that is an energy."""

LABELS: Table = {
    "structure": Variable(
        ("structure",),
        "1",
        "structure: intact, altered (void or inclusion, no cloak), cloaked",
        "str",
        values=("intact", "altered", "cloaked"),
        subset=True,
        coordinate=True,
    ),
    "frequency": Variable(("case",), "Hz", "frequency of the drive", gaps=True, coordinate=True),
    "amplitude": Variable(("case",), "mm", "amplitude of the drive", gaps=True, coordinate=True),
    "time": label(("time",), "s", "time since the start of the drive"),
    "contact_law": names("contact_law", "law of contact", "angle", "geometric"),
    "dof": names("dof", "degree of freedom", "ux", "uy", "theta"),
}
