"""Logs cases with their results as they come: a CSV that is read while it grows, and resumed.

Every part of a sweep appends to a file of its own. A line counts if it is whole and its check, a
CRC-32 of what is before it, holds: whatever ends a process, at most the cases under way are lost.
"""

from __future__ import annotations

import csv
import io
import os
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, TextIO

COLUMNS = ("loss", "loss_altered", "min_void_angle", "status")


class SweepResult(NamedTuple):
    """Holds the result of a case; NaN where there is none, and why."""

    loss: float
    loss_altered: float
    min_void_angle: float
    status: str = "ok"

    @classmethod
    def failed(cls, why: str) -> SweepResult:
        """Makes that of a case without a result."""
        return cls(float("nan"), float("nan"), float("nan"), why)


def header(keys: Sequence[str]) -> list[str]:
    """Names the columns: the case's number, its settings, its results, a check."""
    return ["case", *keys, *COLUMNS, "check"]


def known(folder: Path) -> dict[int, SweepResult]:
    """Reads the results in all files of a folder, by number of the case, without damaged lines."""
    found = {}
    for path in sorted(folder.glob("*.csv")):
        for number, *_, loss, altered, void, status in csv.reader(_valid_lines(path)):
            found[int(number)] = SweepResult(float(loss), float(altered), float(void), status)
    return found


def _valid_lines(path: Path) -> Iterator[str]:
    """Yields the lines of a file whose checksums hold, without these; the heading is none."""
    with path.open(encoding="utf-8", errors="replace", newline="\n") as file:
        for line in file:
            content, _, check = line.rpartition(",")
            if check == f"{_checksum(content)}\n":
                yield content


def _checksum(content: str) -> str:
    return f"{zlib.crc32(content.encode()):08x}"


class CaseLog:
    """Appends results to a file, which is begun where there is none; a context manager."""

    def __init__(self, path: Path, keys: Sequence[str]) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_partial_line(path)
        self._file: TextIO = path.open("a", encoding="utf-8", newline="")
        if path.stat().st_size == 0:
            self._file.write(f"{_row(header(keys))}\n")

    def add(self, rows: Iterable[tuple[int, Sequence[object], SweepResult]]) -> None:
        """Adds numbers, settings and results of some cases, on the disk when this returns."""
        for number, setting, found in rows:
            status = " ".join(found.status.split())
            content = _row([number, *setting, *map(repr, found[:-1]), status])
            self._file.write(f"{content},{_checksum(content)}\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def __enter__(self) -> CaseLog:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def _row(cells: Iterable[object]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(cells)
    return text.getvalue()


def _remove_partial_line(path: Path) -> None:
    """Removes a last line that a kill left unfinished."""
    if path.exists():
        content = path.read_bytes()
        with path.open("r+b") as file:
            file.truncate(content.rfind(b"\n") + 1)
