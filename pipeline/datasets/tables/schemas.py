"""Reads the schema of every kind of dataset: variables with their dims and units (schemas.yaml)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

import yaml

SCHEMA_VERSION = 5

Kind = (
    Literal["design", "design_method", "response", "sweep", "scatter", "verification", "spectrum"]
    | Literal["gains", "certificate", "specimen", "track", "truth", "comparison", "calibration"]
    | Literal["front", "population", "load_cycles", "pictures", "benchmark", "contest", "tracking"]
)
Type = Literal["float64", "float32", "int64", "int8", "str"]


@dataclass(frozen=True)
class Variable:
    """Describes one variable of a dataset; schemas.yaml tells what its attributes mean."""

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


class Schema(NamedTuple):
    """Describes one kind of dataset."""

    table: Table  # its variables, in the order in which they are written
    title: str  # what it holds, in a line; a dataset may have a title of its own
    attributes: Mapping[str, str]  # what it tells in attributes of its own, beside its provenance


def _table(entries: Mapping[str, dict[str, Any]]) -> Table:
    return {
        name: Variable(
            dims=tuple(entry.pop("dims", "").split()),
            units=entry.pop("units", "1"),
            values=tuple(entry.pop("values", ())),
            also=tuple(entry.pop("also", ())),
            **entry,
        )
        for name, entry in entries.items()
    }


_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_READ = yaml.load(Path(__file__).with_suffix(".yaml").read_bytes(), _LOADER)
_PARTS = {name: _table(entries) for name, entries in _READ["parts"].items()}
NETWORK = _PARTS["network"]
"""Variables of the network of units and ligaments."""


def _schema(entry: Mapping[str, Any]) -> Schema:
    table: Table = {}
    for part in entry.get("uses", ()):
        table |= _PARTS[part]
    return Schema(table | _table(entry["variables"]), entry["title"], entry.get("attributes", {}))


SCHEMAS: Mapping[Kind, Schema] = {kind: _schema(entry) for kind, entry in _READ["kinds"].items()}
TABLES: Mapping[Kind, Table] = {kind: schema.table for kind, schema in SCHEMAS.items()}
"""The variables of each kind of dataset."""
