"""Reads the units of a CSV's columns, in their titles or in a line below these."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

from pipeline.problem.fields import units
from pipeline.runtime import UserError

NUMBERS = re.compile(r"[\s\";]*[-+.]?\d")
"""The beginning of a cell or a line of numbers."""
HEADING = re.compile(
    r"(?P<name>.*?)\s*(?:(?P<bracket>[\[(])|(?<=\s)/\s+)(?P<unit>[^\])]+)(?(bracket)[\])])"
)
_UNIT = re.compile(r"[\[(][^\])]+[\])]")
_ENDING = re.compile(r".+[\s_,/](?P<unit>[A-Za-zµμ°]+)")
_FOREIGN = re.compile(
    "ns|ms|us|hrs?|hours?|lbs?|pounds?|lbf|kips?|tonf?|tons|ozf?|dyn|daN|gf|kgf?|m?V"
    "|nm|mm|cm|um|px|mils?|thou|ft|feet"
)
"""Units at the end of a name that are told from a word, whatever is wanted there."""
_LONGEST_CAPITALS = 6


def find_units_below(
    rows: Sequence[list[str]], heading: int, wanted: Mapping[int, units.Dimension]
) -> tuple[int, dict[int, str]]:
    """Finds the line of units between a heading and the numbers, and the words in its columns.

    It is the first line of words that holds a unit of its column, or one in brackets. Lines count
    from one; zero if there is none.
    """
    for line, row in enumerate(rows[heading:], heading + 1):
        words = {column: row[column] for column in wanted if column < len(row) and row[column]}
        if any(NUMBERS.match(word) for word in words.values()):
            break
        if row[:1] and row[0].startswith("#"):
            continue
        if any(_UNIT.fullmatch(word) or _is_unit(word, wanted[at]) for at, word in words.items()):
            return line, {column: word.strip("[]()") for column, word in words.items()}
    return 0, {}


def unit_of_title(title: str) -> str | None:
    """Reads the unit that stands in brackets, or behind a stroke, in a column's title."""
    match = HEADING.fullmatch(title)
    return match and match["unit"]


def unit_at_end(title: str, dimension: units.Dimension) -> str | None:
    """Reads the unit that ends a column's title, if it fits there or can be nothing else."""
    match = _ENDING.fullmatch(title)
    return match["unit"] if match and _is_unit(match["unit"], dimension) else None


def is_line_of_units(row: Sequence[str]) -> bool:
    """Tells whether all words of a line are units, of whatever dimension."""
    kinds = [each for each in vars(units).values() if isinstance(each, units.Dimension)]
    words = [cell.strip("[]()") for cell in row if cell]
    return all(any(_is_unit(word, kind) for kind in kinds) for word in words)


def factor(unit: str | None, dimension: units.Dimension, name: str, path: Path, line: int) -> float:
    """Computes how many working units a column's unit is.

    Raises:
        UserError: it is missing, unknown, of another dimension, or one that nobody uses.
    """
    heading = f"write the heading as {name} ({dimension.unit})"
    if unit is None:
        remedy = f"{heading}, with the unit of the numbers"
        raise UserError(
            "the unit of the column is missing", file=path, line=line, key=name, remedy=remedy
        )
    try:
        return units.parse_quantity(f"1 {_spelled(unit, dimension) or unit}", dimension)
    except units.MisspeltUnitError as error:
        raise UserError(
            error.what, file=path, line=line, key=name, value=unit, remedy=error.remedy
        ) from error
    except UserError as error:
        remedy = f"convert the numbers to {dimension.unit}, and {heading}"
        raise UserError(
            error.what, file=path, line=line, key=name, value=unit, remedy=remedy
        ) from error


def _is_unit(word: str, dimension: units.Dimension) -> bool:
    return _FOREIGN.fullmatch(word) is not None or _spelled(word, dimension) is not None


def _spelled(word: str, dimension: units.Dimension) -> str | None:
    """Spells a unit as it is read; capitals, as in `KN`, are minded where they tell two apart."""
    if _fits(word, dimension):
        return word
    if not (word.isalpha() and 1 < len(word) <= _LONGEST_CAPITALS):
        return None
    spellings = {"".join(each) for each in product(*((c.lower(), c.upper()) for c in word))}
    fitting = [each for each in spellings if _fits(each, dimension, misspelt=False)]
    return fitting[0] if len(fitting) == 1 else None


def _fits(word: str, dimension: units.Dimension, *, misspelt: bool = True) -> bool:
    try:
        units.parse_quantity(f"1 {word}", dimension)
    except units.MisspeltUnitError:
        return misspelt
    except UserError:
        return False
    return True
