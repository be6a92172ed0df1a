"""Damages files: bits turn, ends are lost, people and other software edit them."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from random import Random

import netCDF4
import numpy as np
import xarray as xr

from pipeline.datasets import seal

Damage = Callable[[bytes, Random], bytes]

WORDS = (
    'null', '[]', '{}', '[1, 2]', '{a: b}', 'true', '-1', '0', '1e308', '1e400', '.nan',
    '.inf', '999999999999', '1000000', "''", '"\\0"', '"\\ud800"', '*alias', '&anchor 1',
    '2001-99-99', '0001-01-01T00:00:00+23:59', '15 parsec', '15', '1e300 mm', '-5 mm',
    'nan mm', 'inf s', '../../../../etc/passwd', '/dev/zero', '/', "x" * 5000, 'ü 漢字', '1_000',
    '0x1F', '12:30:45', '"$(touch pwned)"', "'; touch pwned'",
    "!!python/object/apply:os.system ['touch pwned']", '!!timestamp x', "!!int ''", '!!bool x',
    '!!binary x', '!!set {a, b}', '{<<: 1}', '<<: {a: 1}', '[[[[[[1]]]]]]', "[" * 4000,
    '? [a, b]', '|', '>', '%', '@', '`', '- - - 1', '"\\x1b[2J"',
)  # fmt: skip
"""Values that some key of a YAML file, or some cell of a CSV, may be given by mistake or malice."""


def turned_bit(content: bytes, random: Random) -> bytes:
    """Turns a bit."""
    out = bytearray(content)
    out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def turned_bits(content: bytes, random: Random) -> bytes:
    """Turns twenty bits."""
    for _ in range(20):
        content = turned_bit(content, random)
    return content


def cut_short(content: bytes, random: Random) -> bytes:
    """Loses the end."""
    return content[: random.randrange(len(content))]


def emptied(content: bytes, random: Random) -> bytes:
    """Loses all but the name."""
    del content, random
    return b""


def zeroed(content: bytes, random: Random) -> bytes:
    """Zeroes a part, as where a block was never written."""
    start, end = _part(content, random)
    return content[:start] + bytes(end - start) + content[end:]


def scrambled(content: bytes, random: Random) -> bytes:
    """Makes a part noise."""
    start, end = _part(content, random)
    return content[:start] + random.randbytes(end - start) + content[end:]


def lacking(content: bytes, random: Random) -> bytes:
    """Leaves a part out."""
    start, end = _part(content, random)
    return content[:start] + content[end:]


def doubled(content: bytes, random: Random) -> bytes:
    """Doubles a part."""
    start, end = _part(content, random)
    return content[:end] + content[start:]


def lengthened(content: bytes, random: Random) -> bytes:
    """Adds noise behind the end."""
    return content + random.randbytes(random.randint(1, 4000))


def _part(content: bytes, random: Random) -> tuple[int, int]:
    start = random.randrange(len(content))
    return start, min(len(content), start + random.randint(1, 4096))


def _keyed(content: bytes, random: Random) -> tuple[list[str], int]:
    """Returns the lines of a YAML file, and the number of one that has a key."""
    lines = content.decode().splitlines()
    return lines, random.choice([k for k, x in enumerate(lines) if re.match(r"[\s-]*\w+:", x)])


def other_value(content: bytes, random: Random) -> bytes:
    """Gives a key of a YAML file a value of another kind."""
    lines, at = _keyed(content, random)
    head = lines[at].partition(":")[0]
    lines[at] = f"{head}: {random.choice(WORDS)}"
    return "\n".join(lines).encode()


def other_key(content: bytes, random: Random) -> bytes:
    """Gives a key of a YAML file another name."""
    lines, at = _keyed(content, random)
    word = random.choice(("~", "1", "on", "2001-01-01", "'a b'", "? [a]", "<<", "ü", "''", "1.5"))
    lines[at] = re.sub(r"\w+:", lambda _: f"{word}:", lines[at], count=1)
    return "\n".join(lines).encode()


def other_line(content: bytes, random: Random) -> bytes:
    """Loses or doubles a line, or moves it in or out."""
    lines = content.decode().splitlines()
    at = random.randrange(len(lines))
    changed = random.choice(([], [lines[at]] * 2, [f"  {lines[at]}"], [lines[at].lstrip()]))
    return "\n".join([*lines[:at], *changed, *lines[at + 1 :]]).encode()


def other_cell(content: bytes, random: Random) -> bytes:
    """Puts something else into a cell of a CSV."""
    lines = content.decode().splitlines()
    at = random.randrange(len(lines))
    cells = re.split(r"([,;])", lines[at])
    cells[2 * random.randrange((len(cells) + 1) // 2)] = random.choice(
        (*WORDS, "", '"', "nan", "\x00")
    )
    lines[at] = "".join(cells)
    return "\n".join(lines).encode()


ANY: Sequence[Damage] = (
    *(turned_bit, turned_bit, turned_bits, cut_short, cut_short, emptied, zeroed, scrambled),
    *(lacking, doubled, lengthened),
)
YAML: Sequence[Damage] = (other_value, other_value, other_key, other_line)
CSV: Sequence[Damage] = (other_cell, other_line)

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


def _edited(content: bytes, edit: Callable[[Path], Path]) -> bytes:
    """Returns what an edit makes of a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.nc")
        path.write_bytes(content)
        return edit(path).read_bytes()


def _applied(edit: Edit, *, keeps_words: bool) -> Damage:
    """Edits a variable at random; the words about the file's seal may be kept."""

    def edited(content: bytes, random: Random) -> bytes:
        def written(path: Path) -> Path:
            with xr.open_dataset(path, engine="netcdf4", decode_times=False) as opened:
                data = opened.load()
            if not keeps_words:
                data.attrs.pop(seal.ATTRIBUTE, None)
            changed = edit(data, random.choice(sorted(map(str, data.variables))), random)
            changed.to_netcdf(path.with_name("b.nc"))
            return path.with_name("b.nc")

        return _edited(content, written)

    edited.__name__ = ("edited " if keeps_words else OWN) + edit.__name__.replace("_", " ").strip()
    return edited


def _relabelled(*, keeps_words: bool) -> Damage:
    """Gives a variable other words; the author may say that it is meant."""

    def relabelled(content: bytes, random: Random) -> bytes:
        word = random.choice(("", "furlong", 5, 1e300, [1.0, 2.0], "\x1b[2J"))
        keys = ("units", "scale_factor", "add_offset", "coordinates", "calendar")

        def written(path: Path) -> Path:
            with netCDF4.Dataset(path, "a") as raw:
                key = random.choice(keys)
                raw[random.choice(sorted(raw.variables))].setncattr(key, word)
                if not keeps_words and seal.ATTRIBUTE in raw.ncattrs():
                    raw.delncattr(seal.ATTRIBUTE)
            return path

        return _edited(content, written)

    relabelled.__name__ = "relabelled" if keeps_words else "edited_meant_relabelled"
    return relabelled


def huge(content: bytes, random: Random) -> bytes:
    """Claims to hold more than any machine, in a small file."""
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
    *(_relabelled(keeps_words=True), _relabelled(keeps_words=False), huge),
)
