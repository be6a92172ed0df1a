"""Ids of the units."""

from __future__ import annotations

from collections.abc import Iterable

LETTERS = "ABCDEFGHJKLMNPRSTUVXY4"
"""What small units carry instead of their ids; none looks like another one that is turned."""


def column_letters(column: int) -> str:
    """A, B, ... Z, AA, AB, ... for columns from zero, as in a spreadsheet."""
    letters = ""
    column += 1
    while column:
        column, digit = divmod(column - 1, 26)
        letters = chr(ord("A") + digit) + letters
    return letters


def labels(indices: Iterable[tuple[int, int]]) -> list[str]:
    """A unique label for each lattice index (i, j): "C7" is column 2, row 6.

    Units that share an index (the two triangles of a kagome cell) get a, b, ... behind it.
    """
    pairs = [(int(i), int(j)) for i, j in indices]
    shared = len(set(pairs)) < len(pairs)
    seen: dict[tuple[int, int], int] = {}
    made = []
    for pair in pairs:
        nth = seen.get(pair, 0)
        seen[pair] = nth + 1
        suffix = chr(ord("a") + nth) if shared else ""
        made.append(f"{column_letters(pair[0])}{pair[1] + 1}{suffix}")
    return made
