import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import STRtree, box

from pipeline.fabrication.plates import TooLargeError, pack

SHEET, MARGIN, GAP = (100.0, 60.0), 5.0, 2.0
lengths = st.floats(0.5, 50.0)
sizes = st.lists(st.tuples(lengths, lengths), max_size=40)


@given(sizes)
def test_every_part_lies_once_inside_the_margin_and_apart(parts: list[tuple[float, float]]) -> None:
    spots = pack(parts, SHEET, MARGIN, GAP)
    assert [spot.part for spot in spots] == list(range(len(parts)))
    used = {spot.sheet for spot in spots}
    assert used == set(range(len(used)))
    for sheet in used:
        here = [(s.x, s.y, *parts[s.part]) for s in spots if s.sheet == sheet]
        boxes = [box(x, y, x + width, y + height) for x, y, width, height in here]
        room = box(MARGIN, MARGIN, SHEET[0] - MARGIN, SHEET[1] - MARGIN).buffer(1e-6)
        assert all(room.covers(placed) for placed in boxes)
        pairs = STRtree(boxes).query(boxes, "dwithin", GAP - 1e-6)
        assert (pairs[0] == pairs[1]).all()


def test_equal_parts_stay_in_their_order() -> None:
    spots = pack([(10.0, 10.0)] * 20, SHEET, MARGIN, GAP)
    assert spots == sorted(spots, key=lambda spot: (spot.sheet, spot.y, spot.x))


def test_part_larger_than_a_sheet_is_named() -> None:
    with pytest.raises(TooLargeError) as caught:
        pack([(10.0, 10.0), (91.0, 10.0)], SHEET, MARGIN, GAP)
    assert caught.value.part == 1
