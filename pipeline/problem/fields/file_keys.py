"""Defines the type of keys that name files, and lists the files that a section names."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, get_args

from pydantic import BaseModel, StringConstraints
from pydantic.fields import FieldInfo

_NAMED = "names a file or a folder"

File = Annotated[str, StringConstraints(min_length=1), _NAMED]


def named_files(section: BaseModel, folder: Path) -> dict[str, Path]:
    """Lists the files that a section of a YAML file in a folder names, and those below it.

    By their keys, with those above joined by dots and items of lists by their number from 0.
    """
    return {".".join(keys): folder / name for keys, name in _named(section, ())}


def _named(value: object, above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str]]:
    if isinstance(value, BaseModel):
        for name, field in type(value).model_fields.items():
            below, keys = getattr(value, name), (*above, field.alias or name)
            if isinstance(below, str):
                yield from [(keys, below)] if _names_a_file(field) else ()
            else:
                yield from _named(below, keys)
    elif isinstance(value, Mapping):
        for name, below in value.items():
            yield from _named(below, (*above, str(name)))
    elif isinstance(value, list | tuple):
        for number, below in enumerate(value):
            yield from _named(below, (*above, str(number)))


def _names_a_file(field: FieldInfo) -> bool:
    """Tells a key that names a file, be it optional or not."""
    return _NAMED in field.metadata or any(
        _NAMED in get_args(each) for each in get_args(field.annotation)
    )
