"""Files that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.errors import refusal


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A path beside ``path`` to write to: it takes its place at the end, or vanishes on an error.

    Raises:
        UserError: the folder is full, read-only or not ours.
    """
    aside = path.with_name(f".part_{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield aside
        aside.replace(path)
    except OSError as error:
        raise refusal(path, error) from error
    finally:
        aside.unlink(missing_ok=True)
