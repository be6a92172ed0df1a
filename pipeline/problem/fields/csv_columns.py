"""Reads columns of numbers from other programs' CSV files, whatever their separator."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise, takewhile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pipeline.problem.fields import units
from pipeline.runtime import UserError, read_bounded, refusal

if TYPE_CHECKING:
    from sim.core import Floats

_LARGEST = 512 << 20
_UNIT = re.compile(r"[\[(][^\])]+[\])]")
_NUMBERS = re.compile(r"[\s\";]*[-+.]?\d")
_GAP = re.compile(r"(?:[-+]?nan(?:\(.*\))?|#?n/?a|-+|null|none|[-+]?1[.,]#\w+)?", re.IGNORECASE)
"""Cells of what was not measured, as programs write them."""
_HEADING = re.compile(
    r"(?P<name>.*?)\s*(?:(?P<bracket>[\[(])|(?<=\s)/\s+)(?P<unit>[^\])]+)(?(bracket)[\])])"
)
_ENDING = re.compile(r".+[\s_,/](?P<unit>[A-Za-zµ°]+)")
_FOREIGN = re.compile("ns|ms|us|hrs?|hours?|lbs?|lbf|kip|ozf?|dyn|gf|kgf?|m?V|mm|cm|um|px")
"""Units at the end of a name that are told from a word, whatever is wanted there."""


class CsvCells(NamedTuple):
    """Holds the cells of a CSV."""

    rows: list[list[str]]  # of cells, without blanks about them
    separator: str  # comma, semicolon or tab; with these two, a comma may be decimal

    def number(self, row: list[str], column: int) -> float | None:
        """Reads the number in a cell; None where it holds no finite one."""
        text = self.text(row, column)
        try:
            value = float(text if self.separator == "," else text.replace(",", "."))
        except ValueError:
            return None
        return value if math.isfinite(value) else None

    def text(self, row: list[str], column: int) -> str:
        """Returns what stands in a cell; nothing beyond the row's end."""
        return row[column] if column < len(row) else ""


def read_cells(path: Path) -> CsvCells:
    """Reads all cells of a file, a row a line.

    Raises:
        UserError: no such file, too large, or no CSV.
    """
    lines = _lines(path)
    separator = _separator(lines)
    rows = csv.reader(lines, delimiter=separator)
    try:
        return CsvCells([[cell.strip() for cell in row] for row in rows], separator)
    except csv.Error as error:
        remedy = "give plain columns of numbers"
        raise UserError(f"not a readable CSV: {error}", file=path, remedy=remedy) from error


def read_preamble(path: Path) -> list[str]:
    """Reads the lines above the first one of numbers: comments and the heading.

    Raises:
        UserError: no such file, or too large.
    """
    return [*takewhile(lambda line: not _NUMBERS.match(line), _lines(path))]


def _lines(path: Path) -> list[str]:
    try:
        return read_bounded(path, _LARGEST).decode("utf-8-sig", errors="replace").splitlines()
    except FileNotFoundError as error:
        raise UserError("no such file", file=path, remedy="check the path") from error
    except OSError as error:
        raise refusal(path, error) from error


def _separator(lines: list[str]) -> str:
    """Finds the sign that parts most of the lines of numbers; those above may hold any in words."""
    numbers = [line for line in lines if _NUMBERS.match(line)] or lines
    parted = (sign for sign in ";\t" if 2 * sum(sign in line for line in numbers) > len(numbers))
    return next(parted, ",")


def read_columns(
    path: Path, names: Sequence[str], dimensions: Sequence[units.Dimension] = ()
) -> Floats:
    """Reads the named columns (lines, names); lines with gaps, empty or NaN, are left out.

    Lines above the heading are comments, as are those below it that begin with a word or `#`.
    Where the dimensions of columns are given, and the heading (as `NAME (UNIT)`, `NAME / UNIT` or
    `NAME_UNIT`) or the line below it has units, numbers are converted to working units; else they
    are in these.

    Raises:
        UserError: no such file, no such column, a unit of another dimension, no numbers in them, or
            a cell that holds something else.
    """
    import numpy as np

    cells = read_cells(path)
    if dimensions:
        cells = cells._replace(rows=_with_units_below(cells.rows))
    heading, named = _heading(cells.rows, names, path)
    factors: Floats = np.ones(len(names))
    for place, (name, dimension) in enumerate(zip(names, dimensions, strict=False)):
        column = [
            row[named[name]] for row in cells.rows[heading - 1 :][:2] if len(row) > named[name]
        ]
        if (unit := _told_unit(column, dimension)) is not None:
            factors[place] = _factor(unit, dimension, name, path)
    columns = [(name, named[name]) for name in names]
    found: list[list[float | None]] = []
    for line, row in enumerate(cells.rows[heading:], heading + 1):
        values = [cells.number(row, at) for _, at in columns]
        if None not in values:
            found.append(values)
        elif (unread := _unread(cells, row, columns)) is not None:
            remedy = "write plain numbers, without marks of thousands; empty what was not measured"
            raise _not_finite(path, line, *unread, remedy)
    kept = np.array(found, float)
    if not len(kept):
        remedy = "give plain numbers below the heading"
        raise UserError("no line holds numbers in all columns", file=path, remedy=remedy)
    return kept * factors


def read_quantities(path: Path, wanted: Mapping[str, units.Dimension], least: int = 1) -> Floats:
    """Reads the named columns (lines, names) in working units, of at least so many lines.

    The heading names every column as `NAME (UNIT)` or `NAME / UNIT`, or the units stand in the
    line below the names, with or without brackets; lines above it are comments.

    Raises:
        UserError: no such file or column, no unit or a wrong one, too few lines, or a line without
            a finite number.
    """
    import numpy as np

    cells = read_cells(path)
    cells = cells._replace(rows=_with_units_below(cells.rows))
    heading, named = _heading(cells.rows, list(wanted), path)
    if bare := _bare_units(cells.rows[heading:], named, wanted):
        cells.rows[heading] = []
    titles = {name: cells.rows[heading - 1][named[name]] for name in wanted}
    told = {name: _unit(title) or bare.get(name) for name, title in titles.items()}
    factors = [_factor(told[name], wanted[name], name, path) for name in wanted]
    lines = [(number, row) for number, row in enumerate(cells.rows, 1) if any(row)]
    lines = [(number, row) for number, row in lines if number > heading]
    if len(lines) < least:
        remedy = f"give {least} lines or more below the heading"
        raise UserError(f"only {len(lines)} lines of numbers", file=path, remedy=remedy)
    found = np.empty((len(lines), len(wanted)))
    for place, (number, row) in enumerate(lines):
        for column, (name, at) in enumerate((name, named[name]) for name in wanted):
            if (value := cells.number(row, at)) is None:
                remedy = "mend or delete the line: all wanted columns need finite numbers"
                raise _not_finite(path, number, name, cells.text(row, at), remedy)
            found[place, column] = value
    return np.asarray(found * factors)


def _unread(
    cells: CsvCells, row: list[str], columns: list[tuple[str, int]]
) -> tuple[str, str] | None:
    """Finds a column whose cell holds neither number nor gap, and that cell.

    None is found in comments and in lines that begin with a word.
    """
    texts = [(name, at, cells.text(row, at)) for name, at in columns]
    if not any(_NUMBERS.match(text) for *_, text in texts) or row[0].startswith("#"):
        return None
    if texts[0][2][:1].isalpha():  # of a line at the end, such as `Maximum;1020,7`
        return None
    unread = (
        (name, text)
        for name, at, text in texts
        if cells.number(row, at) is None and not _GAP.fullmatch(text)
    )
    return next(unread, None)


def _not_finite(path: Path, line: int, name: str, value: str, remedy: str) -> UserError:
    what = "not a finite number"
    return UserError(what, file=path, line=line, key=name, value=value, remedy=remedy)


def _with_units_below(rows: list[list[str]]) -> list[list[str]]:
    """Joins names and the units that some testing machines write in the line below them."""
    found = list(rows)
    for line, (names, below) in enumerate(pairwise(rows)):
        told = [_UNIT.fullmatch(cell) for cell in below if cell]
        if told and all(told) and len(names) >= len(below):
            blanks = [""] * (len(names) - len(below))
            found[line] = [
                f"{name} {unit}".strip() for name, unit in zip(names, below + blanks, strict=True)
            ]
            found[line + 1] = []
    return found


def _bare_units(
    below: list[list[str]], named: Mapping[str, int], wanted: Mapping[str, units.Dimension]
) -> dict[str, str]:
    """Reads units without brackets in the first of these lines; none where one is no unit."""
    first = below[0] if below else []
    found = {name: first[named[name]] for name in wanted if named[name] < len(first)}
    found = {name: unit for name, unit in found.items() if unit}
    return found if all(_is_unit(unit, wanted[name]) for name, unit in found.items()) else {}


def _heading(
    rows: list[list[str]], wanted: Sequence[str], path: Path
) -> tuple[int, dict[str, int]]:
    """Finds the line of the heading, counted from one, and the column of each name in it."""
    seen: list[str] = []
    for line, row in enumerate(rows, 1):
        matches = [_HEADING.fullmatch(cell) for cell in row]
        bare = {match["name"]: column for column, match in enumerate(matches) if match}
        named = bare | {cell: column for column, cell in enumerate(row)}
        if set(wanted) <= set(named):
            return line, named
        if len(row) >= len(wanted) and not seen:
            seen = row
    remedy = f"name the columns as the file does; it has: {', '.join(seen) or 'none'}"
    raise UserError("columns are missing", file=path, value=list(wanted), remedy=remedy)


def _unit(title: str) -> str | None:
    """Reads the unit that stands in brackets, or behind a stroke, in a column's title."""
    match = _HEADING.fullmatch(title)
    return match and match["unit"]


def _told_unit(column: list[str], dimension: units.Dimension) -> str | None:
    """Reads the unit in a column's title, or in the cell below it.

    A word behind the name, or below it, is one if it fits there or can be nothing else.
    """
    title, *below = column
    if (unit := _unit(title)) is not None:
        return unit
    match = _ENDING.fullmatch(title)
    words = [match["unit"], *below] if match else below
    return next((word for word in words if _is_unit(word, dimension)), None)


def _is_unit(word: str, dimension: units.Dimension) -> bool:
    try:
        units.parse_quantity(f"1 {word}", dimension)
    except UserError:
        return _FOREIGN.fullmatch(word) is not None
    return True


def _factor(unit: str | None, dimension: units.Dimension, name: str, path: Path) -> float:
    """Computes how many working units a column's unit is."""
    heading = f"write the heading as {name} ({dimension.unit})"
    if unit is None:
        remedy = f"{heading}, with the unit of the numbers"
        raise UserError("the unit of the column is missing", file=path, key=name, remedy=remedy)
    try:
        return units.parse_quantity(f"1 {unit}", dimension)
    except UserError as error:
        remedy = f"convert the numbers to {dimension.unit}, and {heading}"
        raise UserError(error.what, file=path, key=name, value=unit, remedy=remedy) from error
