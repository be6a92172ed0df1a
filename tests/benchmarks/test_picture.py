"""The picture on the page of benchmarks shows the page's own tables."""

import numpy as np

from benchmarks.picture import PAGE, TableRow, figure, tables
from reports.base import style


def test_the_tables_are_read_whole() -> None:
    found = tables(PAGE.read_text(encoding="utf-8"))
    wanted = {"fig2": 4, "fig4": 3, "precision": 7, "warm": 2, "static": 6}
    assert {name: len(rows) for name, rows in found.items()} == wanted
    assert found["fig2"][0] == TableRow("ours", 0.443, 3.9e-05)


def test_the_picture_shows_them() -> None:
    found = tables(PAGE.read_text(encoding="utf-8"))
    with style.styled():
        left, right = figure(found).axes
    ends = [bar.get_path().get_extents(bar.get_transform()) for bar in left.patches]
    times = left.transData.inverted().transform([[end.x1, end.y1] for end in ends])[:, 0]
    np.testing.assert_allclose(times, [34.5, 0.00907, 399.0, 0.202, 0.443])
    shown = np.concatenate([np.asarray(line.get_xydata()) for line in right.lines])
    assert set(map(tuple, shown)) == {(row.time, row.error) for row in found["precision"]}
