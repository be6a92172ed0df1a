"""Ids are read back from their strokes, also where slots cut through the letters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon, box

from pipeline.fabrication.engraving import fitted, text, turned
from pipeline.fabrication.engraving.orientation_mark import mark
from pipeline.fabrication.engraving.read_strokes import LEGIBLE, read
from pipeline.fabrication.parts import Strokes
from pipeline.problem.sections import Labels
from sim.core import Floats


def height(words: str, strokes: Sequence[Floats]) -> float | None:
    found = read(words, strokes)
    return None if found is None else found.height


ARROW = (np.array([[5.0, 0.0], [5.5, 1.0], [6.0, 0.0]]),)
ids = st.builds(
    lambda letters, row: f"{letters}{row}",
    st.text("ABCDEFGHIJKLMNOPQRSTUVWXYZ", min_size=1, max_size=2),
    st.integers(1, 31),
)


def cut(strokes: Strokes, slot: Polygon) -> Strokes:
    kept = []
    for stroke in strokes:
        rest = LineString(stroke).difference(slot)
        pieces = getattr(rest, "geoms", [rest])
        kept += [np.asarray(piece.coords) for piece in pieces if piece.length > 0.0]
    return tuple(kept)


@settings(max_examples=30, deadline=None)
@given(ids, st.floats(2.0, 6.0), st.floats(-3.0, 3.0), st.booleans())
def test_an_id_is_read_at_any_place(words: str, size: float, turn: float, stacked: bool) -> None:
    strokes = turned(text(words, size, stacked=stacked), turn, (120.0, -40.0))
    far = tuple(np.add(stroke, [140.0, -40.0]) for stroke in ARROW)
    assert height(words, [*strokes, *far]) == pytest.approx(size, abs=3e-3)


@pytest.mark.parametrize(
    ("drawn", "told"), [("B8", "B6"), ("E6", "F6"), ("A1", "1A"), ("H11", "H1"), ("M3", "M5")]
)
def test_another_id_is_not_read(drawn: str, told: str) -> None:
    strokes = (*text(drawn, 3.0), *ARROW)
    assert height(drawn, strokes) == pytest.approx(3.0, abs=3e-3)
    assert height(told, strokes) is None


def test_an_id_without_a_mark_or_seen_in_a_mirror_is_not_read() -> None:
    strokes = text("F7", 3.0)
    assert height("F7", strokes) is None
    assert height("F7", [stroke * [-1.0, 1.0] for stroke in (*strokes, *ARROW)]) is None


def test_letters_may_be_cut_but_have_to_be_legible() -> None:
    strokes = (*text("K12", 3.0), *ARROW)
    assert height("K12", cut(strokes, box(-5.0, -0.2, 4.0, 0.25))) == pytest.approx(3.0, abs=3e-3)
    assert height("K12", cut(strokes, box(-5.0, -0.7, 4.0, 1.2))) is None


def test_letters_stand_one_by_one_where_slots_leave_no_room_for_a_word() -> None:
    """Between three slots there is room for a letter each, and for no two side by side."""
    body = box(0.0, 0.0, 9.0, 2.6)
    outline = body
    for x in (2.0, 4.5, 7.0):
        outline = Polygon(outline.difference(box(x - 0.2, 0.4, x + 0.2, 3.0)))
    placed = fitted("H12", outline, body, Labels())
    assert placed is not None
    assert placed.kept == pytest.approx(1.0)
    arrow = mark(outline, body, placed.box, Labels())
    assert height("H12", [*placed.strokes, *arrow]) == pytest.approx(2.0, abs=3e-3)


def test_the_least_cut_place_is_taken() -> None:
    body = box(0.0, 0.0, 4.0, 2.6)
    outline = Polygon(body.difference(box(1.0, 1.0, 1.4, 3.0)))
    placed = fitted("A10", outline, body, Labels())
    assert placed is not None
    assert LEGIBLE < placed.kept < 1.0
