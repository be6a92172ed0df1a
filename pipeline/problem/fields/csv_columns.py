"""Reads columns of numbers from other programs' CSV files, whatever their separator."""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pipeline.problem.fields import column_units, units
from pipeline.runtime import UserError, read_bounded, refusal

if TYPE_CHECKING:
    from sim.core import Floats

_LARGEST = 512 << 20
_GAP = re.compile(r"(?:[-+]?nan(?:\(.*\))?|#?n/?a|-+|null|none|[-+]?1[.,]#\w+)?", re.IGNORECASE)
"""Cells of what was not measured, as programs write them."""


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
    return [*takewhile(lambda line: not column_units.NUMBERS.match(line), _lines(path))]


def _lines(path: Path) -> list[str]:
    try:
        return _decode(read_bounded(path, _LARGEST)).splitlines()
    except FileNotFoundError as error:
        raise UserError("no such file", file=path, remedy="check the path") from error
    except OSError as error:
        raise refusal(path, error) from error


def _decode(stored: bytes) -> str:
    """Decodes UTF-16 by its byte order mark, UTF-8 with or without one, else Windows-1252."""
    if stored.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return stored.decode("utf-16", errors="replace")
    try:
        return stored.decode("utf-8-sig")
    except UnicodeDecodeError:
        return stored.decode("cp1252", errors="replace")


def _separator(lines: list[str]) -> str:
    """Finds the sign that parts most of the lines of numbers; those above may hold any in words."""
    numbers = [line for line in lines if column_units.NUMBERS.match(line)] or lines
    parted = (sign for sign in ";\t" if 2 * sum(sign in line for line in numbers) > len(numbers))
    return next(parted, ",")


def read_columns(
    path: Path, names: Sequence[str], dimensions: Sequence[units.Dimension] = ()
) -> Floats:
    """Reads the named columns (lines, names); lines with gaps, empty or NaN, are left out.

    Lines above the heading are comments, as are those below it that begin with a word or `#`.
    Where the dimensions of columns are given, and the heading (as `NAME (UNIT)`, `NAME / UNIT` or
    `NAME_UNIT`) or a line of words below it has units, numbers are converted to working units; else
    they are in these.

    Raises:
        UserError: no such file, no such column, a unit of another dimension, no numbers in them, a
            cell that holds something else, or more numbers than names.
    """
    import numpy as np

    cells = read_cells(path)
    heading, named = _heading(cells.rows, names, path)
    factors: Floats = np.ones(len(names))
    kinds = {named[name]: kind for name, kind in zip(names, dimensions, strict=False)}
    line, below = column_units.find_units_below(cells.rows, heading, kinds)
    for place, (name, dimension) in enumerate(zip(names, dimensions, strict=False)):
        title, at = cells.rows[heading - 1][named[name]], heading
        unit = column_units.unit_of_title(title) or column_units.unit_at_end(title, dimension)
        if unit is None:
            unit, at = below.get(named[name]), line
        if unit is not None:
            factors[place] = column_units.factor(unit, dimension, name, path, at)
    columns = [(name, named[name]) for name in names]
    found: list[list[float | None]] = []
    for line, row in enumerate(cells.rows[heading:], heading + 1):
        values = [cells.number(row, at) for _, at in columns]
        if None not in values:
            _check_width(cells, heading, line, path)
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
    first line of units below the names, with or without brackets; lines above are comments.

    Raises:
        UserError: no such file or column, no unit or a wrong one, too few lines, or a line without
            a finite number or with more numbers than the heading has names.
    """
    import numpy as np

    cells = read_cells(path)
    heading, named = _heading(cells.rows, list(wanted), path)
    kinds = {named[name]: kind for name, kind in wanted.items()}
    line, below = column_units.find_units_below(cells.rows, heading, kinds)
    titles = {name: cells.rows[heading - 1][named[name]] for name in wanted}
    told = {name: column_units.unit_of_title(title) for name, title in titles.items()}
    factors = [
        column_units.factor(told[name], kind, name, path, heading)
        if told[name] is not None
        else column_units.factor(below.get(named[name]), kind, name, path, line or heading)
        for name, kind in wanted.items()
    ]
    lines = [(number, row) for number, row in enumerate(cells.rows, 1) if any(row)]
    lines = [(number, row) for number, row in lines if number > max(heading, line)]
    if len(lines) < least:
        remedy = f"give {least} lines or more below the heading"
        raise UserError(f"only {len(lines)} lines of numbers", file=path, remedy=remedy)
    found = np.empty((len(lines), len(wanted)))
    for place, (number, row) in enumerate(lines):
        _check_width(cells, heading, number, path)
        for column, (name, at) in enumerate((name, named[name]) for name in wanted):
            if (value := cells.number(row, at)) is None:
                remedy = "mend or delete the line: all wanted columns need finite numbers"
                raise _not_finite(path, number, name, cells.text(row, at), remedy)
            found[place, column] = value
    return np.asarray(found * factors)


def _check_width(cells: CsvCells, heading: int, line: int, path: Path) -> None:
    """Refuses numbers beyond the heading's columns, as commas that are decimal too make them."""
    row, width = cells.rows[line - 1], len(cells.rows[heading - 1])
    if cells.separator != "," or not any(column_units.NUMBERS.match(cell) for cell in row[width:]):
        return
    raise UserError(
        "the line has more numbers than the heading has names",
        file=path,
        line=line,
        value=",".join(row),
        remedy="part columns by semicolons or tabs if commas are decimal; else name every column",
    )


def _unread(
    cells: CsvCells, row: list[str], columns: list[tuple[str, int]]
) -> tuple[str, str] | None:
    """Finds a column whose cell holds neither number nor gap, and that cell.

    None is found in comments and in lines that begin with a word.
    """
    texts = [(name, at, cells.text(row, at)) for name, at in columns]
    if not any(column_units.NUMBERS.match(text) for *_, text in texts) or row[0].startswith("#"):
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


def _heading(
    rows: list[list[str]], wanted: Sequence[str], path: Path
) -> tuple[int, dict[str, int]]:
    """Finds the line of the heading, counted from one, and the column of each name in it."""
    for line, row in enumerate(rows, 1):
        matches = [column_units.HEADING.fullmatch(cell) for cell in row]
        bare = [match["name"] if match else None for match in matches]
        if all(name in row or name in bare for name in wanted):
            return line, {name: _only(name, row, bare, path, line) for name in wanted}
    remedy = f"name the columns as the file does; it has: {', '.join(_names(rows)) or 'none'}"
    raise UserError("columns are missing", file=path, value=list(wanted), remedy=remedy)


def _only(
    name: str, titles: Sequence[str], bare: Sequence[str | None], path: Path, line: int
) -> int:
    """Finds the one column of a name: that of a whole title, or of one without its unit."""
    known = titles if name in titles else bare
    found = [column for column, each in enumerate(known) if each == name]
    if len(found) > 1:
        places = " and ".join(f"{column + 1} ({titles[column]})" for column in found)
        raise UserError(
            f"the name is that of the columns {places}",
            file=path,
            line=line,
            key=name,
            remedy="rename the wanted one, or delete the others: one column is read of each name",
        )
    return found[0]


def _names(rows: list[list[str]]) -> list[str]:
    """Finds the last line of words above the numbers that is none of units."""
    filled = [[cell for cell in row if cell] for row in rows]
    shares = [[column_units.NUMBERS.match(cell) is not None for cell in row] for row in filled]
    first = next((k for k, row in enumerate(shares) if row and 2 * sum(row) >= len(row)), len(rows))
    words = [row for row, share in zip(filled[:first], shares, strict=False) if not any(share)]
    named = [row for row in words if row and not column_units.is_line_of_units(row)]
    return named[-1] if named else []
