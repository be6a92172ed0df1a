"""Datasets of older versions, as if they were written today."""

from __future__ import annotations

import xarray as xr

from pipeline.datasets.tables import SCHEMA_VERSION, TABLES, TITLES, Kind, Variable

MIGRATED = (1,)
"""Versions that are read besides the present one."""

_SPELT = {"deg": "degree", "px": "1"}
_WORDS = ("px, mm", "as in constraint_units")


def migrated(dataset: xr.Dataset, kind: Kind) -> xr.Dataset:
    """The dataset with the attributes of the present version.

    Version 1 had the same variables in the same units, which it spelled for people only, and no
    title.
    """
    if dataset.attrs["schema_version"] == SCHEMA_VERSION:
        return dataset
    for name, table in TABLES[kind].items():
        if name in dataset.variables:
            _respell(dataset[name].attrs, table)
    return dataset.assign_attrs(schema_version=SCHEMA_VERSION, title=TITLES[kind])


def _respell(attributes: dict[str, object], table: Variable) -> None:
    units = str(attributes.pop("units", table.units))
    units = table.units if units in _WORDS else _SPELT.get(units, units)
    attributes[table.unit_attribute] = units
