"""Columns of numbers from other programs' CSV files, whatever their separator."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.errors import UserError, refusal
from pipeline.tracking.arrays import Floats


def read(path: Path, names: Sequence[str]) -> Floats:
    """The named columns (rows, names); lines before the heading, and after it those with gaps, go.

    Commas, semicolons and tabs separate; with the latter two, a comma may be the decimal sign.

    Raises:
        UserError: no such file, no such column, or no numbers in them.
    """
    lines = _lines(path)
    separator = next((sign for sign in ";\t" if any(sign in line for line in lines)), ",")
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=separator)]
    at = next((k for k, row in enumerate(rows) if set(names) <= set(row)), None)
    if at is None:
        known = next((", ".join(row) for row in rows if len(row) >= len(names)), "none")
        remedy = f"name the columns as the file does; it has: {known}"
        raise UserError("columns are missing", file=path, value=list(names), remedy=remedy)
    place = [rows[at].index(name) for name in names]
    found = [_numbers(row, place, separator) for row in rows[at + 1 :]]
    kept = np.array([values for values in found if values is not None], float)
    if not len(kept):
        remedy = "give plain numbers below the heading"
        raise UserError("no line holds numbers in all columns", file=path, remedy=remedy)
    return kept


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except FileNotFoundError as error:
        raise UserError("no such file", file=path, remedy="check the path") from error
    except OSError as error:
        raise refusal(path, error) from error


def _numbers(row: list[str], place: Sequence[int], separator: str) -> list[float] | None:
    """The numbers at some places of a row; None if one is missing."""
    if len(row) <= max(place):
        return None
    cells = [row[k] if separator == "," else row[k].replace(",", ".") for k in place]
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None
