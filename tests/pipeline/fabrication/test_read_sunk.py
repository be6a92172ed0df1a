"""Ids that are sunk into the underside are read back, in a mirror, also where slots cut them."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box

from pipeline.fabrication.engraving import Reading, fitted
from pipeline.fabrication.engraving.orientation_mark import mark
from pipeline.fabrication.engraving.read_strokes import read
from pipeline.fabrication.engraving.read_sunk import shows
from pipeline.fabrication.engraving.reading_order import in_order
from pipeline.fabrication.parts import pen
from pipeline.problem.sections import Labels

BODY = box(0.0, 0.0, 7.0, 3.4)
SLOTTED = Polygon(BODY.difference(box(2.4, 1.2, 2.8, 3.4)))
PLACES = [np.array([[0.0, 0.0], [5.0, 0.0]]), np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, -1.2]])]


def sunk(words: str, outline: Polygon, *, mirrored: bool = True) -> tuple[Polygon, Reading]:
    """The underside of a part, and how the same letters stand on its top."""
    placed = fitted(words, outline, BODY, Labels())
    assert placed is not None
    arrow = mark(outline, BODY, placed.box, Labels())
    pose = read(words, placed.strokes + arrow)
    assert pose is not None
    letters = placed.mirrored if mirrored else placed.strokes
    return outline.difference(pen(letters, 0.4).union(pen(arrow, 0.4))), pose


@pytest.mark.parametrize("outline", [BODY, SLOTTED])
@pytest.mark.parametrize(("words", "other"), [("F7", "E7"), ("C8", "B8"), ("K12", "K14")])
def test_its_own_id_is_read_and_no_other(outline: Polygon, words: str, other: str) -> None:
    underside, pose = sunk(words, outline)
    assert shows(words, underside, outline, pose)
    assert not shows(other, underside, outline, pose)


def test_letters_that_are_no_mirror_image_are_not_read() -> None:
    underside, pose = sunk("F7", BODY, mirrored=False)
    assert not shows("F7", underside, BODY, pose)


def test_a_plain_underside_shows_nothing() -> None:
    _, pose = sunk("F7", BODY)
    assert not shows("F7", BODY.difference(box(3.0, 1.0, 3.4, 1.4)), BODY, pose)


def test_the_heaviest_places_that_read_are_taken() -> None:
    first = np.array([1.0, 3.0])
    assert in_order(PLACES, [first, np.array([1.0, 4.0, 2.0])]) == ([1, 2], 5.0)  # below
    assert in_order(PLACES, [first, np.array([4.5, 4.0, 1.0])]) == ([0, 0], 5.5)  # on a line


def test_nothing_is_taken_where_no_places_read() -> None:
    assert in_order([PLACES[0][1:], PLACES[1][:2]], [np.ones(1), np.ones(2)]) == ([], 0.0)
    assert in_order([PLACES[0], np.empty((0, 2))], [np.ones(2), np.empty(0)]) == ([], 0.0)
