"""Columns of other programs' CSV files, each with its unit in brackets in the heading."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pipeline.problem.fields import units
from pipeline.runtime import UserError
from pipeline.tracking.frames import csv_columns
from sim.core import Floats

LEAST = 5
"""Lines below the heading that any fit needs."""

_HEADING = re.compile(r"\s*(?P<name>.*?)\s*[\[(](?P<unit>[^\])]+)[\])]\s*")


def read(path: Path, wanted: Mapping[str, units.Dimension]) -> Floats:
    """The named columns (lines, names) in working units.

    Args:
        path: a CSV whose heading names every column as `NAME (UNIT)`; lines above it are comments.
        wanted: names and what they are.

    Raises:
        UserError: no such file or column, no unit or a wrong one, too few lines, or a line without
            a finite number.
    """
    table = csv_columns.cells(path)
    heading, named = _heading(table.rows, list(wanted), path)
    place, factors = [], []
    for name, dimension in wanted.items():
        place.append(named[name][0])
        factors.append(_factor(named[name][1], dimension, path, name))
    lines = [row for row in table.rows[heading + 1 :] if any(row)]
    if len(lines) < LEAST:
        remedy = f"give {LEAST} lines or more below the heading"
        raise UserError(f"only {len(lines)} lines of numbers", file=path, remedy=remedy)
    found = [[_number(table, row, at, path) for at in place] for row in lines]
    return np.array(found) * factors


def _heading(
    rows: list[list[str]], wanted: list[str], path: Path
) -> tuple[int, dict[str, tuple[int, str | None]]]:
    """The row of the heading, and of each name in it the column and the unit."""
    seen: list[str] = []
    for number, row in enumerate(rows):
        named: dict[str, tuple[int, str | None]] = {}
        for column, cell in enumerate(row):
            match = _HEADING.fullmatch(cell)
            named[match["name"] if match else cell] = (column, match["unit"] if match else None)
        if set(wanted) <= set(named):
            return number, named
        if len(row) >= len(wanted) and not seen:
            seen = list(named)
    remedy = f"name the columns as the file does; it has: {', '.join(seen) or 'none'}"
    raise UserError("columns are missing", file=path, value=wanted, remedy=remedy)


def _factor(unit: str | None, dimension: units.Dimension, path: Path, name: str) -> float:
    """Working units in one of the column's."""
    remedy = f"write the heading as {name} ({dimension.unit}), with the unit of the numbers"
    if unit is None:
        raise UserError("the unit of the column is missing", file=path, key=name, remedy=remedy)
    try:
        return units.parse(f"1 {unit}", dimension)
    except units.QuantityError as error:
        raise UserError(error.what, file=path, key=name, value=unit, remedy=remedy) from error


def _number(table: csv_columns.CsvCells, row: list[str], at: int, path: Path) -> float:
    """The number in a cell.

    Raises:
        UserError: there is none.
    """
    text = row[at] if at < len(row) else ""
    value = csv_columns.number(text, table.separator)
    if value is None:
        remedy = "mend or delete the line: all wanted columns need finite numbers"
        line = table.rows.index(row) + 1
        raise UserError("not a finite number", file=path, line=line, value=text, remedy=remedy)
    return value
