import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon

from pipeline.fabrication.parts import Slot
from pipeline.fabrication.units.slot_candidates import Corner, side_truncations
from pipeline.fabrication.units.slots import NoRoomError, place_slots
from pipeline.fabrication.units.unit_outlines import cut, filleted, lugs, room_to_grow
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication

ASKED = Fabrication()
HAIR = 1e-4
NARROW = [(4.46896165512347, 0.22362346), (3.832e-16, 6.256990381816461)]
NARROW += [(-4.33, 1.1057908244251284), (-1.15e-15, -6.258)]


def asked(**slots: object) -> Fabrication:
    return Fabrication.model_validate({"slots": slots}, context=SIM_UNITS)


def corners(polygon: Polygon) -> list[Corner]:
    """A slot at every vertex; ligaments point away from the centroid."""
    points = np.asarray(polygon.exterior.coords)[:-1]
    ways = np.array([polygon.centroid.x, polygon.centroid.y]) - points
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return [Corner(vertex, vertex, way, 2.25) for vertex, way in enumerate(ways)]


def cap(slot: Slot) -> LineString:
    """The inner end of a slot, across."""
    side = slot.width / 2 * np.array([-slot.direction[1], slot.direction[0]])
    return LineString([slot.end - side, slot.end + side])


def channel(slot: Slot) -> Polygon:
    return LineString([slot.mouth, slot.end]).buffer(slot.width / 2, cap_style="flat")


@st.composite
def quads(draw: st.DrawFn) -> Polygon:
    """Convex quadrilaterals with edges of at least 3 mm and angles of at least 30 deg."""
    lengths = [draw(st.floats(2.0, 12.0)) for _ in range(4)]
    turns = [draw(st.floats(-0.4, 0.4)) for _ in range(4)]
    angles = np.arange(4) * np.pi / 2 + turns
    points = np.array(lengths)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    edges = np.roll(points, -1, axis=0) - points
    behind = -np.roll(edges, 1, axis=0)
    cross = edges[:, 0] * behind[:, 1] - edges[:, 1] * behind[:, 0]
    inside = np.arctan2(cross, (edges * behind).sum(axis=1))
    assume(np.linalg.norm(edges, axis=1).min() >= 3.0)
    assume(inside.min() >= np.radians(30.0) and inside.max() <= np.radians(179.0))
    return Polygon(points)


def square(side: float) -> Polygon:
    half = side / np.sqrt(2.0)
    return Polygon([(half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)])


def test_slots_are_three_mm_deep_and_more_in_a_sharp_corner() -> None:
    polygon = square(9.594)
    for slot in place_slots(polygon, corners(polygon), ASKED, polygon):
        assert slot.depth == 3.0
        assert slot.width == pytest.approx(0.45)
        assert slot.direction == pytest.approx(-slot.mouth / np.linalg.norm(slot.mouth))
        # at a right angle the wall beside the slot grows as fast as one goes in
        assert slot.truncation == pytest.approx(0.225 + 0.1)
        assert slot.wall == pytest.approx((3.0 - 0.225) / np.sqrt(2.0))
    half = np.radians(15.0)
    arm = 20.0 * np.array([np.cos(half), np.sin(half)])
    polygon = Polygon([(0.0, 0.0), arm * [1, -1], arm])
    corner = Corner(0, 0, np.array([1.0, 0.0]), 2.25)
    (slot,) = place_slots(polygon, [corner], asked(direction="ligament"), polygon)
    least = (0.8 + 0.225 * np.cos(half)) / np.sin(half)  # 0.56 mm would be left at 3 mm
    assert slot.depth == pytest.approx(np.ceil(least / 0.25) * 0.25)
    assert slot.wall >= 0.8


@settings(max_examples=60, deadline=None)
@given(quads(), st.sampled_from(["centroid", "ligament", "bisector"]))
@example(Polygon(NARROW), "bisector")
def test_slots_leave_walls_keep_apart_and_are_open(polygon: Polygon, direction: str) -> None:
    wanted = asked(direction=direction)
    room = polygon
    try:
        slots = place_slots(polygon, corners(polygon), wanted, polygon)
    except NoRoomError:
        room = room_to_grow(polygon, [], wanted.slots.thicken, wanted)
        try:
            slots = place_slots(polygon, corners(polygon), wanted, room)
        except NoRoomError:
            assume(False)
    body = lugs(polygon, room, slots, wanted)
    truncated = [side_truncations(body, slot, wanted) for slot in slots]
    made = cut(body, slots, truncated, wanted)
    assert made.is_valid
    assert not made.interiors
    for slot in slots:
        assert cap(slot).distance(room.exterior) >= wanted.minimum_wall - HAIR
        assert wanted.slots.depth_min <= slot.depth <= wanted.slots.depth_max
        assert channel(slot).intersection(made).area < HAIR
    for index, first in enumerate(slots):
        for second in slots[index + 1 :]:
            assert channel(first).distance(channel(second)) >= wanted.minimum_wall - HAIR


@settings(max_examples=40, deadline=None)
@given(st.floats(30.0, 150.0), st.floats(0.0, 0.5))
def test_tips_are_cut_back_to_the_asked_thickness(angle: float, tip: float) -> None:
    half = np.radians(angle) / 2
    arm = 20.0 * np.array([np.cos(half), np.sin(half)])
    polygon = Polygon([(0.0, 0.0), arm * [1, -1], (40.0, 0.0), arm])
    wanted = asked(tip=tip)
    slot = Slot(0, 0, np.zeros(2), np.array([1.0, 0.0]), 5.0, wanted.slot_width, 0.0, 1.0)
    right, left = side_truncations(polygon, slot, wanted)
    exact = (wanted.slot_width / 2 + tip) / np.tan(half)
    assert (right, left) == pytest.approx((exact, exact))
    made = cut(polygon, [slot], [(right, left)], wanted)
    for sign in (-1.0, 1.0):
        across = LineString([(exact + 1e-3, 0.0), (exact + 1e-3, sign * 20.0)])
        assert across.intersection(made).length >= tip
    assert made.bounds[0] == pytest.approx(exact, abs=2e-3)


def test_too_slender_a_corner_is_named_with_the_wall_that_it_could_have() -> None:
    sliver = Polygon([(0.0, 0.0), (30.0, 0.0), (30.0, 1.0), (0.0, 1.0)])
    with pytest.raises(NoRoomError) as caught:
        place_slots(sliver, [Corner(0, 0, np.array([1.0, 0.0]), 2.25)], ASKED, sliver)
    assert caught.value.vertex == 0
    assert caught.value.wall == pytest.approx((1.0 - 0.45) / 2, abs=0.05)


def test_units_grow_as_far_as_the_gap_and_fillets_round_corners() -> None:
    sliver = Polygon([(0.0, 0.0), (30.0, 0.0), (30.0, 1.4), (0.0, 1.4)])
    neighbour = shapely.box(0.0, 1.7, 30.0, 5.0)
    room = room_to_grow(sliver, [neighbour], 1.0, ASKED)
    assert room.covers(sliver)
    assert room.distance(neighbour) >= ASKED.minimum_gap
    assert room.bounds[1] == pytest.approx(-1.0)
    rounded = filleted(square(10.0), 1.0)
    assert rounded.area == pytest.approx(100.0 - (4.0 - np.pi), rel=1e-3)
    assert filleted(square(10.0), 0.0).equals(square(10.0))
