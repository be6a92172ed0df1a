"""Spreads a drawing at true scale over as few pages as hold it, with strips where they overlap."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from pipeline.fabrication.papers.pdf_paper import Box

OVERLAP = 12.0
"""Width of the strip that two neighbouring pages share, mm."""


@dataclass(frozen=True)
class Tile:
    """Holds one page's part of the drawing.

    Attributes:
        name: row letter from the top and column number, "B2".
        window: its part, in the drawing's coordinates.
        row, column: from the top left, from zero.
        of: rows and columns of pages.
    """

    name: str
    window: Box
    row: int
    column: int
    of: tuple[int, int]

    def joints(self) -> Iterator[tuple[str, float]]:
        """Yields the middle lines of the strips shared with other pages: ("x" or "y", position)."""
        left, low, width, height = self.window
        half = OVERLAP / 2
        if self.column > 0:
            yield "x", left + half
        if self.column < self.of[1] - 1:
            yield "x", left + width - half
        if self.row > 0:
            yield "y", low + height - half
        if self.row < self.of[0] - 1:
            yield "y", low + half


def tiles(box: Box, page: tuple[float, float]) -> list[Tile]:
    """Covers `box` with equal windows, no larger than `page`, row by row from the top left."""
    left, low, width, height = box
    rows, tall = _split(height, page[1])
    columns, wide = _split(width, page[0])
    return [
        Tile(
            f"{chr(ord('A') + row)}{column + 1}",
            (
                left + column * (wide - OVERLAP),
                low + (rows - 1 - row) * (tall - OVERLAP),
                wide,
                tall,
            ),
            row,
            column,
            (rows, columns),
        )
        for row in range(rows)
        for column in range(columns)
    ]


def _split(length: float, most: float) -> tuple[int, float]:
    """Counts the windows along a length, and measures each."""
    count = max(1, math.ceil((length - OVERLAP) / (most - OVERLAP)))
    return count, (length + (count - 1) * OVERLAP) / count
