"""Reads columns of numbers from other programs' CSV files, whatever their separator."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.runtime import UserError, read_bounded, refusal
from sim.core import Floats

_LARGEST = 512 << 20


class CsvCells(NamedTuple):
    """Holds the cells of a CSV.

    Attributes:
        rows: of cells, without blanks about them.
        separator: a comma, semicolon or tab; with the latter two, a comma may be the decimal sign.
    """

    rows: list[list[str]]
    separator: str


def cells(path: Path) -> CsvCells:
    """Reads all cells of a file, a row a line.

    Raises:
        UserError: no such file, too large, or no CSV.
    """
    lines = _lines(path)
    separator = next((sign for sign in ";\t" if any(sign in line for line in lines)), ",")
    rows = csv.reader(lines, delimiter=separator)
    try:
        return CsvCells([[cell.strip() for cell in row] for row in rows], separator)
    except csv.Error as error:
        remedy = "give plain columns of numbers"
        raise UserError(f"not a readable CSV: {error}", file=path, remedy=remedy) from error


def read(path: Path, names: Sequence[str]) -> Floats:
    """Reads columns (rows, names); lines before the heading, and after it those with gaps, go.

    Commas, semicolons and tabs separate; with the latter two, a comma may be the decimal sign.

    Raises:
        UserError: no such file, no such column, or no numbers in them.
    """
    rows, separator = cells(path)
    at = next((k for k, row in enumerate(rows) if set(names) <= set(row)), None)
    if at is None:
        known = next((", ".join(row) for row in rows if len(row) >= len(names)), "none")
        remedy = f"name the columns as the file does; it has: {known}"
        raise UserError("columns are missing", file=path, value=list(names), remedy=remedy)
    place = [rows[at].index(name) for name in names]
    found = [[_at(row, k, separator) for k in place] for row in rows[at + 1 :]]
    kept = np.array([values for values in found if None not in values], float)
    if not len(kept):
        remedy = "give plain numbers below the heading"
        raise UserError("no line holds numbers in all columns", file=path, remedy=remedy)
    return kept


def _lines(path: Path) -> list[str]:
    try:
        return read_bounded(path, _LARGEST).decode("utf-8-sig", errors="replace").splitlines()
    except FileNotFoundError as error:
        raise UserError("no such file", file=path, remedy="check the path") from error
    except OSError as error:
        raise refusal(path, error) from error


def _at(row: list[str], column: int, separator: str) -> float | None:
    return number(row[column], separator) if column < len(row) else None


def number(text: str, separator: str) -> float | None:
    """Parses a cell of a file with this separator; None where it holds no finite number."""
    try:
        value = float(text if separator == "," else text.replace(",", "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None
