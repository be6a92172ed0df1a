"""Tables as CSV: numbers as they are, and no cell that a spreadsheet would compute."""

import csv
from io import StringIO

import numpy as np

from reports.base import Table


def test_a_text_that_looks_like_a_formula_is_a_text() -> None:
    words = ["=1+1", "@a", "+cmd", "-5 mm", "−5 mm", "a=b", "-1e-3", "", "=HYPERLINK(1)"]
    table = Table("t.csv", "", {"word": words, "number": np.linspace(-1.0, 1.0, len(words))})
    rows = list(csv.reader(StringIO(table.csv.decode())))
    shown = ["'=1+1", "'@a", "'+cmd", "'-5 mm", "−5 mm", "a=b", "-1e-3", "", "'=HYPERLINK(1)"]
    assert [row[0] for row in rows[1:]] == shown
    assert rows[1][1] == "-1"
