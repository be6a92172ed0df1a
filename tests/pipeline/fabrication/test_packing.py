from dataclasses import replace

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon, STRtree, affinity, box

from pipeline.fabrication.fixtures import fixtures
from pipeline.fabrication.fixtures.specimen_holders import adapter
from pipeline.fabrication.parts import Layer, PrintedPart
from pipeline.fabrication.plates import STRAND, TooLargeError, estimate_print, pack
from pipeline.fabrication.plates.packing import Ground, spread
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication
from tests.pipeline.fabrication import handmade

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


def test_equal_parts_keep_their_order_and_one_too_large_is_named() -> None:
    spots = pack([(10.0, 10.0)] * 20, SHEET, MARGIN, GAP)
    assert spots == sorted(spots, key=lambda spot: (spot.sheet, spot.y, spot.x))
    with pytest.raises(TooLargeError) as caught:
        pack([(10.0, 10.0), (91.0, 10.0)], SHEET, MARGIN, GAP)
    assert caught.value.part == 1


def block(side: float, height: float = 6.0) -> PrintedPart:
    return PrintedPart("A1", (Layer(box(0.0, 0.0, side, side), 0.0, height),))


def test_every_part_is_spread_once() -> None:
    parts = [block(20.0 + number) for number in range(20)]
    sheets = list(spread(parts, Ground("sheet", "laser", SHEET, MARGIN, GAP), "problem.yaml"))
    assert len(sheets) > 2
    laid = [part.size for sheet in sheets for part, _, _ in sheet]
    assert sorted(laid) == [part.size for part in parts]


def test_an_adapter_holds_its_unit_and_touches_no_other() -> None:
    """Seen as it is used: it is printed on its back."""
    one = handmade.specimen()
    unit = one.units[1]
    fingers = adapter("DRIVE", unit, Polygon(), one, handmade.ASKED).layers[-1].area
    placed = affinity.scale(fingers, xfact=-1.0, origin=(0.0, 0.0))
    assert placed.area > 20.0
    others = [other.outline for other in one.units if other is not unit]
    assert placed.distance(shapely.union_all(others)) >= 1.4
    assert placed.distance(unit.outline) == pytest.approx(handmade.ASKED.fixture.clearance)


def test_bolts_of_a_grip_in_pieces_keep_off_their_ends() -> None:
    """Four in a row 10 mm apart; the middle piece, of 15 mm, has one of its own in its middle."""
    held = replace(handmade.specimen(), clamped=("A1", "B1", "C1"))
    given = {"print": {"bed": ["30 mm", "99 mm"]}, "fixture": {"bolt_pitch": "10 mm"}}
    asked = Fabrication.model_validate(given, context=SIM_UNITS)
    made = (part for part in fixtures(held, asked, handmade.SPACING) if "LID" in part.id)
    assert [len(lid.layers[0].area.interiors) for lid in made] == [1, 1, 1]


def test_infill_saves_what_is_far_from_top_and_bottom() -> None:
    """Inside three perimeters, but for three layers of 0.3 mm at both ends."""
    inside = (30.0 - 6 * 0.3856) ** 2 * (6.0 - 6 * 0.3)
    solid, sparse = (estimate_print([block(30.0)], share) for share in (1.0, 0.25))
    saved = (solid.filament - sparse.filament) * STRAND
    assert saved == pytest.approx(0.75 * inside, rel=0.01)
    assert sparse.seconds < solid.seconds
    found = estimate_print([block(30.0)], 1.0)
    assert found.filament * STRAND == pytest.approx(30.0**2 * 6.0, rel=0.01)


@pytest.mark.parametrize("side", [0.3, 1.0, 2.2])
def test_a_part_without_an_inside_is_its_perimeters(side: float) -> None:
    one, other = (estimate_print([block(side)], share) for share in (0.0, 1.0))
    assert one == other
    assert one.seconds > 0.0


def test_a_plate_takes_what_its_parts_take() -> None:
    one, two = estimate_print([block(10.0)], 0.5), estimate_print([block(10.0)] * 2, 0.5)
    assert two == pytest.approx((2 * one.seconds, 2 * one.filament))
