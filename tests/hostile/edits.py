"""NetCDF files that other software wrote again, with something changed."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random

import netCDF4
import numpy as np
import xarray as xr

from pipeline.datasets import seal
from tests.hostile.damage import Damage

OWN = "edited meant "
"""Starts the names of edits whose author says, by the attribute about the seal, that they are."""

Edit = Callable[[xr.Dataset, str, Random], xr.Dataset]


def _without(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    del random
    return data.drop_vars(name)


def _renamed(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    del random
    return data.rename_vars({name: f"{name}_2"})


def _of_another_type(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    variable = data.variables[name]
    kind = random.choice(("<U9", "float32", "int16", "uint8"))
    values = np.zeros(variable.shape, kind)
    return data.drop_vars(name).assign({name: (variable.dims, values, variable.attrs)})


def _of_another_shape(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    del random
    variable = data.variables[name]
    values = np.zeros((*variable.shape, 2))
    return data.drop_vars(name).assign({name: ((*variable.dims, "new"), values, variable.attrs)})


def _gone(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    variable = data.variables[name]
    wrong = random.choice((np.nan, np.inf, -999.0))
    values = np.full(variable.shape, wrong)
    return data.drop_vars(name).assign({name: (variable.dims, values, variable.attrs)})


def _shorter(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    dims = data.variables[name].dims
    return data.isel({random.choice(dims): slice(0, -1)}) if dims else data.drop_vars(name)


def _of_other_origin(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    del name
    key = random.choice(
        ("kind", "schema_version", "problem", "parents", "problem_hash", "synthetic")
    )
    return data.assign_attrs({key: random.choice(("", "track", -1, 10**9, 2.5, [1, 2, 3], "{"))})


def _applied(edit: Edit, *, keeps_words: bool) -> Damage:
    """The edit of a variable at random; the words about the file's seal may be kept."""

    def edited(content: bytes, random: Random) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "a.nc")
            path.write_bytes(content)
            with xr.open_dataset(path, engine="netcdf4", decode_times=False) as opened:
                data = opened.load()
            if not keeps_words:
                data.attrs.pop(seal.ATTRIBUTE, None)
            changed = edit(data, random.choice(sorted(map(str, data.variables))), random)
            changed.to_netcdf(path.with_name("b.nc"))
            return path.with_name("b.nc").read_bytes()

    edited.__name__ = ("edited " if keeps_words else OWN) + edit.__name__.replace("_", " ").strip()
    return edited


def _relabelled(content: bytes, random: Random, *, keeps_words: bool) -> bytes:
    word = random.choice(("", "furlong", 5, 1e300, [1.0, 2.0], "\x1b[2J"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.nc")
        path.write_bytes(content)
        with netCDF4.Dataset(path, "a") as raw:
            key = random.choice(("units", "scale_factor", "add_offset", "coordinates", "calendar"))
            raw[random.choice(sorted(raw.variables))].setncattr(key, word)
            if not keeps_words and seal.ATTRIBUTE in raw.ncattrs():
                raw.delncattr(seal.ATTRIBUTE)
        return path.read_bytes()


def relabelled(content: bytes, random: Random) -> bytes:
    """A variable has other words."""
    return _relabelled(content, random, keeps_words=True)


def edited_meant_relabelled(content: bytes, random: Random) -> bytes:
    """So it has, and its author says that it is meant."""
    return _relabelled(content, random, keeps_words=False)


def huge(content: bytes, random: Random) -> bytes:
    """A small file that claims to hold more than any machine."""
    del content, random
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.nc")
        with netCDF4.Dataset(path, "w") as made:
            made.setncatts({"kind": "design", "schema_version": 2})
            made.createDimension("unit", 10**6)
            made.createDimension("vertex", 10**6)
            made.createVariable("vertices", "f8", ("unit", "vertex"), chunksizes=(1000, 1000))
        return path.read_bytes()


_EDITS: Sequence[Edit] = (
    *(_without, _renamed, _of_another_type, _of_another_shape, _gone, _shorter),
    _of_other_origin,
)
NETCDF: Sequence[Damage] = (
    *(_applied(edit, keeps_words=keeps) for edit in _EDITS for keeps in (False, True)),
    *(relabelled, edited_meant_relabelled, huge),
)
