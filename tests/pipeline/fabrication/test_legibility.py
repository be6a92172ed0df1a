"""Ids are read back from their strokes, from the top and from below, also where slots cut them."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiLineString, MultiPolygon, Polygon, box

from pipeline.fabrication.checks.assembled_specimen import unit_sections
from pipeline.fabrication.checks.package_record import ExpectedParts
from pipeline.fabrication.checks.slot_checks import UnitSection, check_section
from pipeline.fabrication.engraving import orientation_mark, place_id, text_strokes, transformed
from pipeline.fabrication.parts import Strokes, UnbuildableUnitError, unit_solid
from pipeline.fabrication.readback import MeshBody
from pipeline.problem.sections import Fabrication, Labels
from tests.pipeline.fabrication import slender
from tests.pipeline.fabrication.stroke_reader import read
from tests.tables import some

ARROW = (np.array([[5.0, 0.0], [5.5, 1.0], [6.0, 0.0]]),)
ids = st.builds(
    lambda letters, row: f"{letters}{row}",
    st.text("ABCDEFGHIJKLMNOPQRSTUVWXYZ", min_size=1, max_size=2),
    st.integers(1, 31),
)


def cut(strokes: Strokes, slot: Polygon) -> Strokes:
    rest = MultiLineString([LineString(stroke) for stroke in strokes]).difference(slot)
    return tuple(np.asarray(piece.coords) for piece in rest.geoms)


def mirrored(strokes: Strokes) -> Strokes:
    return tuple(stroke * [-1.0, 1.0] for stroke in strokes)


@settings(max_examples=20, deadline=None)
@given(ids, st.floats(2.0, 6.0), st.floats(-3.0, 3.0), st.booleans())
def test_an_id_is_read_at_any_place(words: str, size: float, turn: float, stacked: bool) -> None:
    strokes = transformed(text_strokes(words, size, stacked=stacked), turn, (120.0, -40.0))
    far = tuple(np.add(stroke, [140.0, -40.0]) for stroke in ARROW)
    assert read(words, [*strokes, *far]) == pytest.approx(size, abs=3e-3)


@pytest.mark.parametrize(
    ("drawn", "other"), [("B8", "B6"), ("E6", "F6"), ("A1", "1A"), ("H11", "H1"), ("M3", "M5")]
)
def test_another_id_is_not_read(drawn: str, other: str) -> None:
    strokes = (*text_strokes(drawn, 3.0), *ARROW)
    assert read(drawn, strokes) == pytest.approx(3.0, abs=3e-3)
    assert read(other, strokes) is None


def test_an_id_needs_a_mark_and_enough_of_its_letters_and_no_mirror() -> None:
    strokes = text_strokes("K12", 3.0)
    assert read("K12", strokes) is None
    assert read("K12", mirrored((*strokes, *ARROW))) is None
    little = cut((*strokes, *ARROW), box(-5.0, -0.2, 4.0, 0.25))
    assert read("K12", little) == pytest.approx(3.0, abs=3e-3)
    assert read("K12", cut((*strokes, *ARROW), box(-5.0, -0.7, 4.0, 1.2))) is None


def test_letters_stand_one_by_one_where_slots_leave_no_room_for_a_word() -> None:
    """Between three slots there is room for a letter each, and for no two side by side."""
    body = box(0.0, 0.0, 9.0, 2.6)
    outline = body
    for x in (2.0, 4.5, 7.0):
        outline = Polygon(outline.difference(box(x - 0.2, 0.4, x + 0.2, 3.0)))
    placed = place_id("H12", outline, body, Labels())
    assert placed is not None
    assert placed.kept == pytest.approx(1.0)
    arrow = orientation_mark(outline, body, placed, Labels())
    assert read("H12", [*placed.strokes, *arrow]) == pytest.approx(2.0, abs=3e-3)


def test_the_least_cut_place_is_taken() -> None:
    body = box(0.0, 0.0, 4.0, 2.6)
    outline = Polygon(body.difference(box(1.0, 1.0, 1.4, 3.0)))
    placed = place_id("A10", outline, body, Labels())
    assert placed is not None
    assert 0.7 < placed.kept < 1.0


@pytest.mark.parametrize("name", some(slender.UNITS, 6))
def test_the_id_of_a_slender_unit_is_read_on_both_sides(name: str) -> None:
    """And the printed unit is sunk along what is read from below, but for its rim."""
    unit = slender.built(name)
    words = unit.letter or unit.label
    assert read(words, unit.lettering + unit.mark) is not None
    assert read(words, mirrored(unit.underside) + unit.mark) is not None
    if unit.letter:
        assert read(unit.label, unit.lettering + unit.mark) is None
    sunk = unit.outline.difference(unit_solid(unit, Fabrication()).layers[0].area)
    lines = MultiLineString([LineString(stroke) for stroke in unit.underside])
    assert sunk.covers(lines.intersection(unit.outline.buffer(-0.2, join_style="mitre")))


SETTINGS = Fabrication()


@pytest.mark.parametrize("name", some(slender.UNITS, 6))
def test_a_slender_unit_is_built_without_a_fault(name: str) -> None:
    unit, data = slender.built(name), slender.UNITS[name]
    vertices = [vertex for vertex, *_ in data["slots"]]
    shape = UnitSection(unit.label, slender.FILE, unit.design, unit.outline, vertices)
    assert [fault.what for fault in check_section(shape, SETTINGS)] == []
    gaps = [unit.outline.distance(Polygon(ring)) for ring in data["neighbours"]]
    assert min(gaps, default=1.0) >= SETTINGS.minimum_gap - 1e-4


def test_a_unit_that_grew_to_twice_its_size_is_found_in_its_place() -> None:
    """Less than half of it covers its design."""
    thin, beside = Polygon([(0, 0), (9, 0), (9, 1), (0, 1)]), Polygon([(0, 4), (9, 4), (9, 9)])
    grown = thin.buffer(1.0, join_style="mitre")
    solid = SimpleNamespace(section=lambda _height: MultiPolygon([beside, grown]))
    expected = ExpectedParts({"A1": thin, "A2": beside}, {})
    sections = unit_sections(cast("MeshBody", solid), expected, SETTINGS)
    assert sections["A1"].equals(grown)
    assert sections["A2"].equals(beside)


def test_a_unit_without_room_for_its_id_carries_a_letter() -> None:
    name = next(name for name, data in slender.UNITS.items() if data["label"] == "AD15")
    assert slender.built(name).letter == "A"
    assert slender.built(name, letters="YV").letter == "Y"
    with pytest.raises(UnbuildableUnitError, match="no room for the id of unit AD15"):
        slender.built(name, letters="")
