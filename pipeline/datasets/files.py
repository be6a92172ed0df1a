"""Stores datasets as netCDF-4, whole or not at all: the same bytes for the same data."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import psutil
import xarray as xr

from pipeline.datasets import seal
from pipeline.datasets.tables import SCHEMA_VERSION, SCHEMAS, TABLES, Kind, Variable
from pipeline.datasets.validation import MIGRATED, find_faults, migrate
from pipeline.runtime import UNREADABLE, UserError, write_atomically

_CHUNK = bytes(1 << 20)
_MOST = 1100
"""Bytes of data in a byte of a file: deflate makes nothing smaller than by 1032."""

Loaded = TypeVar("Loaded")


class SchemaError(ValueError):
    """Reports that a stage tried to write what the tables do not describe: a mistake in code."""


def write(dataset: xr.Dataset, path: str | Path, kind: Kind, provenance: Mapping[str, str]) -> None:
    """Writes `dataset` as a file of `kind`, atomically: another file appears whole or not at all.

    Units, long names, flag meanings and types come from the table of the kind; the variables need
    not carry them.

    Args:
        dataset: the data; its attributes are kept, those of the provenance added.
        path: the file; its folder is made if need be.
        kind: which table it obeys.
        provenance: attributes from `pipeline.datasets.provenance.attributes`.

    Raises:
        SchemaError: the dataset is not as the table has it.
        UserError: the folder is full, read-only or not ours.
    """
    path = Path(path)
    described = _described(dataset, kind, provenance)
    for fault in find_faults(described, kind):
        told = "" if fault.value is None else f": {fault.value}"
        raise SchemaError(f"{kind} dataset, {fault.name}: {fault.what}{told}")
    with write_atomically(path) as aside:
        try:
            _to_netcdf(described, aside, kind)
            seal.write_seal(aside)
            read(aside, kind)
        except (OSError, RuntimeError) as error:  # netCDF4 seldom says why a write failed
            raise _probe(aside, dataset.nbytes) or error from error


def read(path: str | Path, kind: Kind) -> xr.Dataset:
    """Reads a file of `kind` into memory, checked against its table.

    Raises:
        UserError: missing, truncated, foreign, of another kind or version, or not as the table
            has it.
    """
    path = Path(path)
    remedy = _remedy(path)
    sealed, dataset = _opened(path, _loaded)
    _check_origin(dataset, path, kind, remedy)
    dataset = migrate(dataset, kind)
    for fault in find_faults(dataset, kind):
        raise UserError(fault.what, file=path, key=fault.name, value=fault.value, remedy=remedy)
    _check_kept(dataset.attrs, sealed, path)
    return dataset


def read_attributes(path: str | Path) -> Mapping[str, Any]:
    """Reads the attributes of a dataset of any kind, its seal checked and its data left alone.

    Raises:
        UserError: missing, unreadable, or not what was written.
    """

    def attributes(path: Path) -> dict[str, Any]:
        with xr.open_dataset(path, engine="netcdf4", decode_times=False) as opened:
            return dict(opened.attrs)

    sealed, found = _opened(Path(path), attributes)
    _check_kept(found, sealed, Path(path))
    return found


def _opened(path: Path, load: Callable[[Path], Loaded]) -> tuple[seal.State, Loaded]:
    """Checks the seal of a file and loads from it."""
    remedy = _remedy(path)
    try:
        sealed = seal.check_seal(path)
        if sealed == "broken":
            raise UserError("damaged: it is not what was written", file=path, remedy=remedy)
        return sealed, load(path)
    except FileNotFoundError as error:
        remedy = "run the stage that makes it first"
        raise UserError("no such dataset", file=path, remedy=remedy) from error
    except PermissionError as error:
        raise UserError("no permission to read it", file=path, remedy="check its mode") from error
    except UNREADABLE as error:
        raise UserError("not a readable netCDF file", file=path, remedy=remedy) from error


def _remedy(path: Path) -> str:
    """Tells to make a dataset again; a file of another name may be the user's own, and stays."""
    if path.suffix == ".nc":
        return "delete it and run the stage that makes it again"
    return "give a dataset of this workflow, such as design.nc"


def _check_kept(attributes: dict[Any, Any], sealed: seal.State, path: Path) -> None:
    """Takes the words about a seal off the attributes; refuses a file that has lost it."""
    if attributes.pop(seal.ATTRIBUTE, None) is not None and sealed == "absent":
        what = "its seal is missing: it was cut off, or changed by other software"
        remedy = f"{_remedy(path)}; or remove this attribute, if the change was meant"
        raise UserError(what, file=path, key=seal.ATTRIBUTE, remedy=remedy)


def _loaded(path: Path) -> xr.Dataset:
    with xr.open_dataset(
        path, engine="netcdf4", decode_times=False, decode_timedelta=False
    ) as opened:
        most = min(_MOST * path.stat().st_size, psutil.virtual_memory().available)
        if opened.nbytes > most:
            what = f"it would fill {opened.nbytes >> 20} MiB of memory"
            raise UserError(what, file=path, remedy="check where it is from; or free some memory")
        return opened.load()


def _check_origin(dataset: xr.Dataset, path: Path, kind: Kind, remedy: str) -> None:
    found, version = dataset.attrs.get("kind"), dataset.attrs.get("schema_version")
    if found is None or not isinstance(version, int | np.integer):
        what = "a netCDF file, but none of this workflow's (it has no `kind` and `schema_version`)"
        raise UserError(what, file=path, remedy=f"give a {kind} dataset")
    if str(found) != kind:
        what, remedy = f"a {kind} dataset is wanted", f"give a {kind} dataset"
        if (str(found), kind) == ("design_method", "design"):
            remedy = "`python -m pipeline select` makes one of the designs of all methods"
        raise UserError(what, file=path, key="kind", value=str(found), remedy=remedy)
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
    """Gives a dataset the order of its table, and the attributes and types that this states."""
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
        "title": SCHEMAS[kind].title,
        "kind": kind,
        "schema_version": SCHEMA_VERSION,
        **dataset.attrs,
        **provenance,
        seal.ATTRIBUTE: seal.DESCRIPTION,
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


def _probe(path: Path, size: int) -> OSError | None:
    """Tries plain writing of `size` bytes at `path`, and returns its error, if any."""
    try:
        with path.open("wb") as file:
            for _ in range(size // len(_CHUNK) + 1):
                file.write(_CHUNK)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        return error
    return None
