"""Damages files: bits turn, ends are lost, people and other software edit them."""

import re
import tempfile
from collections.abc import Callable, Hashable, Sequence
from functools import partial
from pathlib import Path
from random import Random

import netCDF4
import numpy as np
import xarray as xr
import yaml

from pipeline.datasets import seal
from pipeline.runtime import ROOT

Damage = Callable[[bytes, Random], bytes]

_GIVEN = yaml.safe_load((ROOT / "tests/data/hostile/words.yaml").read_text(encoding="utf-8"))
WORDS, TOKENS = tuple(_GIVEN["words"]), tuple(_GIVEN["tokens"])
"""Values to give to some key of a YAML file, cell of a CSV or part of a drawing."""


def _turn_bits(content: bytes, random: Random, count: int) -> bytes:
    out = bytearray(content)
    for _ in range(count):
        out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def _in_part(change: Callable[[bytes, Random], bytes]) -> Damage:

    def changed(content: bytes, random: Random) -> bytes:
        start = random.randrange(len(content))
        end = min(len(content), start + random.randint(1, 4096))
        return content[:start] + change(content[start:end], random) + content[end:]

    return changed


def _in_line(change: Callable[[str, Random], list[str]], pattern: str = "") -> Damage:
    """Changes a line of a text that matches the pattern, to any number of lines."""

    def changed(content: bytes, random: Random) -> bytes:
        lines = content.decode().splitlines()
        at = random.choice([k for k, line in enumerate(lines) if re.match(pattern, line)])
        return "\n".join([*lines[:at], *change(lines[at], random), *lines[at + 1 :]]).encode()

    return changed


def _other_cell(line: str, random: Random) -> list[str]:
    cells = re.split(r"([,;])", line)
    other = random.choice((*WORDS, "", '"', "nan", "\x00"))
    cells[2 * random.randrange((len(cells) + 1) // 2)] = other
    return ["".join(cells)]


_KEYED = r"[\s-]*\w+:"
_KEYS = ("~:", "1:", "on:", "2001-01-01:", "'a b':", "? [a]:", "<<:", "ü:", "'':", "1.5:")
_line = _in_line(lambda line, r: r.choice(([], [line] * 2, [f"  {line}"], [line.lstrip()])))
_value = _in_line(lambda line, r: [f"{line.partition(':')[0]}: {r.choice(WORDS)}"], _KEYED)
_key = _in_line(lambda line, r: [re.sub(r"\w+:", r.choice(_KEYS), line, count=1)], _KEYED)

Damages = Sequence[tuple[str, Damage]]
ANY: Damages = (
    *[("turned bit", lambda content, r: _turn_bits(content, r, 1))] * 2,
    ("turned bits", lambda content, r: _turn_bits(content, r, 20)),
    *[("cut short", lambda content, r: content[: r.randrange(len(content))])] * 2,
    ("emptied", lambda _, __: b""),
    ("zeroed, as where a block was never written", _in_part(lambda part, _: bytes(len(part)))),
    ("scrambled", _in_part(lambda part, r: r.randbytes(len(part)))),
    ("lacking", _in_part(lambda _, __: b"")),
    ("doubled", _in_part(lambda part, _: part * 2)),
    ("lengthened", lambda content, r: content + r.randbytes(r.randint(1, 4000))),
)
YAML: Damages = (*[("other value", _value)] * 2, ("other key", _key), ("other line", _line))
CSV: Damages = (("other cell", _in_line(_other_cell)), ("other line", _line))


def _other_token(content: bytes, random: Random) -> bytes:
    text = content.decode("utf-8", "replace")
    found = list(re.finditer(r"[\w.+-]+", text))
    for one in sorted(random.sample(found, random.randint(1, 3)), key=lambda it: -it.start()):
        text = text[: one.start()] + random.choice(TOKENS) + text[one.end() :]
    return text.encode()


def _repeated(content: bytes, random: Random) -> bytes:
    start = random.randrange(len(content))
    end = min(len(content), start + random.randint(1, 200))
    return content[:end] + content[start:end] * random.choice((10, 1000, 20_000)) + content[end:]


TEXT: Damages = (*[("other token", _other_token)] * 4, ("repeated", _repeated))

OWN = "edited meant "
"""Starts the names of edits whose author says, by the attribute about the seal, that they are."""


def _replaced(data: xr.Dataset, name: str, dims: Sequence[Hashable], values: object) -> xr.Dataset:
    return data.drop_vars(name).assign({name: (dims, values, data[name].attrs)})


def _of_another_type(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    kind = random.choice(("<U9", "float32", "int16", "uint8"))
    return _replaced(data, name, data[name].dims, np.zeros(data[name].shape, kind))


def _of_another_shape(data: xr.Dataset, name: str, _: Random) -> xr.Dataset:
    return _replaced(data, name, (*data[name].dims, "new"), np.zeros((*data[name].shape, 2)))


def _gone(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    wrong = random.choice((np.nan, np.inf, -999.0))
    return _replaced(data, name, data[name].dims, np.full(data[name].shape, wrong))


def _shorter(data: xr.Dataset, name: str, random: Random) -> xr.Dataset:
    dims = data[name].dims
    return data.isel({random.choice(dims): slice(0, -1)}) if dims else data.drop_vars(name)


def _of_other_origin(data: xr.Dataset, _: str, random: Random) -> xr.Dataset:
    keys = ("kind", "schema_version", "problem", "parents", "problem_hash", "synthetic")
    key = random.choice(keys)
    return data.assign_attrs({key: random.choice(("", "track", -1, 10**9, 2.5, [1, 2, 3], "{"))})


EDITS: dict[str, Callable[[xr.Dataset, str, Random], xr.Dataset]] = {
    "without": lambda data, name, _: data.drop_vars(name),
    "renamed": lambda data, name, _: data.rename_vars({name: f"{name}_2"}),
    "of another type": _of_another_type,
    "of another shape": _of_another_shape,
    "gone": _gone,
    "shorter": _shorter,
    "of other origin": _of_other_origin,
}


def _edited(content: bytes, random: Random, what: str, *, meant: bool) -> bytes:
    """Edits a variable at random; where that is meant, the file loses the words about its seal."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.nc")
        path.write_bytes(content)
        with xr.open_dataset(path, engine="netcdf4", decode_times=False) as opened:
            data = opened.load()
        if meant:
            data.attrs.pop(seal.ATTRIBUTE, None)
        changed = EDITS[what](data, random.choice(sorted(map(str, data.variables))), random)
        changed.to_netcdf(path.with_name("b.nc"))
        return path.with_name("b.nc").read_bytes()


def _relabelled(content: bytes, random: Random, *, meant: bool) -> bytes:
    """Gives a variable other words."""
    word = random.choice(("", "furlong", 5, 1e300, [1.0, 2.0], "\x1b[2J"))
    key = random.choice(("units", "scale_factor", "add_offset", "coordinates", "calendar"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.nc")
        path.write_bytes(content)
        with netCDF4.Dataset(path, "a") as raw:
            raw[random.choice(sorted(raw.variables))].setncattr(key, word)
            if meant and seal.ATTRIBUTE in raw.ncattrs():
                raw.delncattr(seal.ATTRIBUTE)
        return path.read_bytes()


def _huge(*_: object) -> bytes:
    """Claims to hold more than any machine, in a small file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.nc")
        with netCDF4.Dataset(path, "w") as made:
            made.setncatts({"kind": "design", "schema_version": 2})
            made.createDimension("unit", 10**6)
            made.createDimension("vertex", 10**6)
            made.createVariable("vertices", "f8", ("unit", "vertex"), chunksizes=(1000, 1000))
        return path.read_bytes()


NETCDF: Damages = (
    *((f"edited {what}", partial(_edited, what=what, meant=False)) for what in EDITS),
    *((OWN + what, partial(_edited, what=what, meant=True)) for what in EDITS),
    ("relabelled", partial(_relabelled, meant=False)),
    (f"{OWN}relabelled", partial(_relabelled, meant=True)),
    ("huge", _huge),
)
