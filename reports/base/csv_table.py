"""Describes data tables of a report, as CSV."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Starts a cell that a spreadsheet would compute; an apostrophe before it makes it a text."""
_NUMBER = re.compile(r"[-+]?[\d.]+([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Table:
    """Describes a table that lies beside the page as a CSV file and inside it as a download."""

    name: str
    text: str
    columns: Mapping[str, NDArray[Any] | Sequence[Any]]

    @property
    def n_rows(self) -> int:
        """Returns number of rows without the heading."""
        return len(next(iter(self.columns.values())))

    @property
    def csv(self) -> bytes:
        """Returns the table as CSV: ten significant digits, empty where there is no value."""
        lines = StringIO()
        writer = csv.writer(lines, lineterminator="\n")
        writer.writerow(self.columns)
        cells = ([_cell(value) for value in column] for column in self.columns.values())
        writer.writerows(zip(*cells, strict=True))
        return lines.getvalue().encode("utf-8")


def _cell(value: object) -> str:
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else f"{value:.10g}"
    text = str(value)
    return f"'{text}" if text.startswith(_FORMULA) and _NUMBER.fullmatch(text) is None else text
