"""Datasets on disk: netCDF-4, whole or not at all, and the same bytes for the same data."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.datasets.migration import MIGRATED, migrated
from pipeline.datasets.tables import SCHEMA_VERSION, TABLES, TITLES, Kind
from pipeline.datasets.validation import faults
from pipeline.datasets.variables import Variable
from pipeline.errors import UserError, refusal

_CHUNK = bytes(1 << 20)


class SchemaError(ValueError):
    """A stage tried to write what the tables do not describe: a mistake in the code."""


def write(dataset: xr.Dataset, path: str | Path, kind: Kind, provenance: Mapping[str, str]) -> None:
    """Write `dataset` as a file of `kind`, atomically: another file appears whole or not at all.

    Units, long names, flag meanings and types come from the table of the kind; the variables need
    not carry them.

    Args:
        dataset: the data; its attributes are kept, those of the provenance added.
        path: the file; its folder is made if need be.
        kind: which table it obeys.
        provenance: attributes from `pipeline.provenance.attributes`.

    Raises:
        SchemaError: the dataset is not as the table has it.
        UserError: the folder is full, read-only or not ours.
    """
    path = Path(path)
    described = _described(dataset, kind, provenance)
    for fault in faults(described, kind):
        told = "" if fault.value is None else f": {fault.value}"
        raise SchemaError(f"{kind} dataset, {fault.name}: {fault.what}{told}")
    aside = path.with_name(f".{path.name}.part")  # one name: a killed write leaves no second one
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _to_netcdf(described, aside, kind)
        _sync(aside)
        read(aside, kind)
        aside.replace(path)
        _sync(path.parent)
    except (OSError, RuntimeError) as error:  # netCDF4 seldom says why a write failed
        cause = _probe(aside, dataset.nbytes) or error
        if not isinstance(cause, OSError):
            raise
        raise refusal(path.parent, cause) from error
    finally:
        _discard(aside)


def read(path: str | Path, kind: Kind) -> xr.Dataset:
    """Read a file of `kind` into memory, checked against its table.

    Raises:
        UserError: missing, truncated, foreign, of another kind or version, or not as the table
            has it.
    """
    path = Path(path)
    remedy = "delete it and run the stage that makes it again"
    try:
        with xr.open_dataset(
            path, engine="netcdf4", decode_times=False, decode_timedelta=False
        ) as opened:
            dataset = opened.load()
    except FileNotFoundError as error:
        remedy = "run the stage that makes it first"
        raise UserError("no such dataset", file=path, remedy=remedy) from error
    except PermissionError as error:
        raise UserError("no permission to read it", file=path, remedy="check its mode") from error
    except (OSError, RuntimeError, ValueError) as error:
        raise UserError("not a readable netCDF file", file=path, remedy=remedy) from error
    _check_origin(dataset, path, kind, remedy)
    dataset = migrated(dataset, kind)
    for fault in faults(dataset, kind):
        raise UserError(fault.what, file=path, key=fault.name, value=fault.value, remedy=remedy)
    return dataset


def _check_origin(dataset: xr.Dataset, path: Path, kind: Kind, remedy: str) -> None:
    found, version = dataset.attrs.get("kind"), dataset.attrs.get("schema_version")
    if found is None or version is None:
        what = "a netCDF file, but none of this workflow's (it has no `kind` and `schema_version`)"
        raise UserError(what, file=path, remedy=f"give a {kind} dataset")
    if found != kind:
        what = f"a {kind} dataset is wanted"
        raise UserError(what, file=path, key="kind", value=found, remedy=f"give a {kind} dataset")
    if version not in (*MIGRATED, SCHEMA_VERSION):
        newer = version > SCHEMA_VERSION
        raise UserError(
            f"its schema version is not {SCHEMA_VERSION}",
            file=path,
            key="schema_version",
            value=int(version),
            remedy="update this software, which is older than the file" if newer else remedy,
        )


def _described(dataset: xr.Dataset, kind: Kind, provenance: Mapping[str, str]) -> xr.Dataset:
    """The dataset in the order of its table, with the attributes and types that this states."""
    table = TABLES[kind]
    described = {
        str(name): _describe(variable, table[str(name)]) if name in table else variable
        for name, variable in dataset.variables.items()
    }
    order = {name: index for index, name in enumerate(table)}
    names = sorted(described, key=lambda name: order.get(name, len(order)))
    labels = [name for name in names if name in table and table[name].coordinate]
    attributes = {
        "Conventions": "CF-1.11",
        "title": TITLES[kind],
        "kind": kind,
        "schema_version": SCHEMA_VERSION,
        **dataset.attrs,
        **provenance,
    }
    return xr.Dataset(
        {name: described[name] for name in names if name not in labels},
        {name: described[name] for name in labels},
        dict(sorted(attributes.items())),
    )


def _describe(variable: xr.Variable, table: Variable) -> xr.Variable:
    known = {table.unit_attribute: table.units, "long_name": table.long_name}
    attributes = {**known, **variable.attrs}
    if table.flags:
        attributes["flag_values"] = np.array(list(table.flags.values()), dtype=table.dtype)
        attributes["flag_meanings"] = " ".join(table.flags)
    values = variable.values
    if table.dtype != "str" and np.can_cast(values.dtype, table.dtype, "same_kind"):
        values = values.astype(table.dtype, copy=False)
    return xr.Variable(variable.dims, values, dict(sorted(attributes.items())))


def _to_netcdf(dataset: xr.Dataset, path: Path, kind: Kind) -> None:
    encoding = {str(name): _encoding(TABLES[kind][str(name)]) for name in dataset.variables}
    dataset.to_netcdf(path, engine="netcdf4", format="NETCDF4", encoding=encoding)


def _encoding(table: Variable) -> dict[str, object]:
    """Strings as fixed arrays of characters: variable lengths cannot be compressed."""
    if table.dtype == "str":
        return {"dtype": "S1"}
    packed = {"zlib": True, "complevel": 4} if table.dims else {}
    return {"_FillValue": np.nan if table.gaps else None, **packed}


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _probe(path: Path, size: int) -> OSError | None:
    """The error that plain writing of `size` bytes meets at `path`, if any."""
    try:
        with path.open("wb") as file:
            for _ in range(size // len(_CHUNK) + 1):
                file.write(_CHUNK)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        return error
    return None


def _discard(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return  # the error that matters is the one already on its way
