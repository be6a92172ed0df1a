"""Tables of inputs and of what is told of them, kept as data; and the check of what is told."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import pytest
import yaml

from pipeline.runtime import UserError

Test = TypeVar("Test", bound=Callable[..., None])


@cache
def tables(room: str) -> dict[str, Any]:
    """Reads the tables of a room."""
    path = Path(__file__).parent / f"data/tables/{room}.yaml"
    return dict(yaml.load(path.read_text(encoding="utf-8"), yaml.CSafeLoader))


def cases(room: str, names: str, *more: object) -> Callable[[Test], Test]:
    """Parametrises a test by the rows of the table of its name, and by some that are computed."""

    def decorated(test: Test) -> Test:
        table = tables(room)[test.__name__.removeprefix("test_")]
        ids = list(table) if isinstance(table, dict) else None
        rows = [*table.values()] if isinstance(table, dict) else [*table, *more]
        made: Test = pytest.mark.parametrize(names.split(", "), rows, ids=ids)(test)
        return made

    return decorated


def some(rows: Iterable[Any], count: int = 2) -> list[Any]:
    """Lists rows for a test, all but the first ``count`` of them for `make test-slow`."""
    first, rest = [*rows][:count], [*rows][count:]
    later = [
        pytest.param(*row, marks=pytest.mark.slow)
        if isinstance(row, tuple)
        else pytest.param(row, marks=pytest.mark.slow)
        for row in rest
    ]
    return [*first, *later]


@contextmanager
def refused(
    what: str, key: str | None = None, remedy: str = "", file: Path | None = None
) -> Iterator[Any]:
    """Asserts that an error of the user's is told: what it is, its key, a remedy and the file."""
    with pytest.raises(UserError) as caught:
        yield caught
    assert what in caught.value.what
    assert key is None or caught.value.key == key
    assert caught.value.remedy
    assert remedy in str(caught.value.remedy)
    assert file is None or caught.value.file == str(file)
