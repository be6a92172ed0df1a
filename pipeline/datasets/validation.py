"""Checks datasets against their tables, those of older versions as if they were written today."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from pipeline.datasets.tables import SCHEMA_VERSION, SCHEMAS, TABLES, Kind, Variable

_KINDS = {"float64": "f", "float32": "f", "int64": "iu", "int8": "biu", "str": "OUST"}
MIGRATED = (1, 2, 3, 4)
"""Versions that are read besides the present one."""
_TRACED = ("snap_load", "traced_load", "traced_force", "traced_eigenvalue")
_TURNED = ("end_angles",)
_ADDED: dict[Kind, tuple[str, ...]] = {
    "response": ("snap", "eigenvalue", "loss_other_branch", "snaps_by_contact", *_TRACED),
    "design": _TURNED,
    "design_method": _TURNED,
}
"""Variables that older versions did not have; NaN."""

_SPELT = {"deg": "degree", "px": "1"}
_WORDS = ("px, mm", "as in constraint_units")


@dataclass(frozen=True)
class SchemaFault:
    """Reports a fault of a variable or attribute."""

    what: str
    name: str
    value: object = None


def find_faults(dataset: xr.Dataset, kind: Kind) -> Iterator[SchemaFault]:
    """Finds faults that keep `dataset` from being one of `kind`, beside its provenance."""
    table = TABLES[kind]
    for name, variable in table.items():
        if name not in dataset.variables:
            yield SchemaFault("the variable is missing", name)
        else:
            yield from _variable_faults(dataset.variables[name], name, variable)
    for unknown in dataset.variables.keys() - table.keys():
        yield SchemaFault(f"a {kind} dataset has no such variable", str(unknown))
    for name, meaning in SCHEMAS[kind].attributes.items():
        if name not in dataset.attrs:
            yield SchemaFault(f"the attribute is missing ({meaning})", name)


def _variable_faults(found: xr.Variable, name: str, table: Variable) -> Iterator[SchemaFault]:
    if found.dims != table.dims:
        yield SchemaFault(f"its dims are not {_tuple(table.dims)}", name, _tuple(found.dims))
    elif found.dtype.kind not in _KINDS[table.dtype]:
        yield SchemaFault(f"its type is not {table.dtype}", name, str(found.dtype))
    elif not _known_units(units := found.attrs.get(table.unit_attribute, table.units), table):
        yield SchemaFault(f"its unit is not {table.units!r}", name, units)
    else:
        yield from _value_faults(found.values, name, table)


def _known_units(told: object, table: Variable) -> bool:
    return isinstance(told, str) and told in (table.units, *table.also)  # a list may be told


def _value_faults(values: np.ndarray, name: str, table: Variable) -> Iterator[SchemaFault]:
    if table.values and tuple(values.tolist()) != _expected(values, table):
        yield SchemaFault(
            f"its values are not {_tuple(table.values)}", name, _tuple(values.tolist())
        )
    if table.flags and not np.isin(values, list(table.flags.values())).all():
        meanings = ", ".join(f"{value} {flag}" for flag, value in table.flags.items())
        yield SchemaFault(f"a flag has no meaning ({meanings})", name)
    if table.dtype in ("float64", "float32"):
        if np.isinf(values).any():
            yield SchemaFault("infinite values", name)
        if not table.gaps and np.isnan(values).any():
            yield SchemaFault("NaN where every value is needed", name)


def _expected(values: np.ndarray, table: Variable) -> tuple[str, ...]:
    """Lists the values that a coordinate should have: all, or those present, in their order."""
    if not table.subset:
        return table.values
    return tuple(value for value in table.values if value in values)


def _tuple(names: object) -> str:
    return "(" + ", ".join(map(str, names)) + ")"  # type: ignore[call-overload]


def migrate(dataset: xr.Dataset, kind: Kind) -> xr.Dataset:
    """Gives a dataset the attributes of the present version.

    Version 1 had the same variables in the same units, which it spelled for people only, and no
    title. Version 2 said less of stability, version 3 traced no paths, version 4 turned no slots.
    """
    if dataset.attrs["schema_version"] == SCHEMA_VERSION:
        return dataset
    for name, table in TABLES[kind].items():
        if name in dataset.variables:
            _respell(dataset[name].attrs, table)
        elif name in _ADDED.get(kind, ()):
            unknown = np.full([dataset.sizes.get(dim, 1) for dim in table.dims], np.nan)
            dataset[name] = (table.dims, unknown, {table.unit_attribute: table.units})
    return dataset.assign_attrs(schema_version=SCHEMA_VERSION, title=SCHEMAS[kind].title)


def _respell(attributes: dict[str, object], table: Variable) -> None:
    units = str(attributes.pop("units", table.units))
    units = table.units if units in _WORDS else _SPELT.get(units, units)
    attributes[table.unit_attribute] = units
