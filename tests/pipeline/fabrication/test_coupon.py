"""The block that tries clearances of slots holds together, however deep these are."""

from pathlib import Path

import pytest
import shapely

from pipeline.fabrication.engraving import text_extent
from pipeline.fabrication.fixtures.flat_fixtures import (
    _COUPON_PITCH,
    _clearance_words,
    coupon,
    coupon_solid,
)
from pipeline.fabrication.papers import read_bill
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication
from tests.pipeline.fabrication import built


@pytest.mark.parametrize("depth", [4.0, 9.0, 16.0])
def test_slots_end_inside_the_coupon(depth: float) -> None:
    slots = {"depth": depth, "depth_max": max(depth, 9.0)}
    settings = Fabrication.model_validate({"slots": slots}, context=SIM_UNITS)
    outline = coupon(settings).outline
    low, high = outline.bounds[1::2]
    assert outline.is_valid
    assert high - low >= depth + 5.0
    assert len(outline.exterior.coords) == 5 + 4 * len(settings.coupon)


def test_a_coupon_in_layers_has_room_for_a_pin_at_both_ends() -> None:
    settings = Fabrication()
    plain, layered = coupon(settings), coupon(settings, layered=True)
    assert not plain.holes
    pins = [shapely.Point(pin.centre).buffer(pin.diameter / 2) for pin in layered.holes]
    assert len(pins) == 2
    for pin in pins:
        wall = float(layered.outline.exterior.distance(pin))
        assert wall == pytest.approx(settings.minimum_wall, abs=0.01)
    slots = [shapely.get_coordinates(part.outline)[:, 0] for part in (plain, layered)]
    assert set(slots[0][1:-1]) - {0.0, 55.0} <= set(slots[1])


@pytest.mark.parametrize(("aspect", "count"), [(3.0, 6), (20.0, 1)])
def test_the_coupon_is_cut_from_as_many_sheets_as_the_units(
    tmp_path: Path, aspect: float, count: int
) -> None:
    built.write(tmp_path / "cloaked", {"laser": {"aspect_ratio": aspect}})
    rows = {row["id"]: row for row in read_bill(tmp_path / "cloaked/bom.csv")}
    units, tried = (rows[f"laser/{kind}_sheet1_nominal.dxf"] for kind in ("units", "coupon"))
    assert int(units["count"]) == int(tried["count"]) == count
    assert tried["note"].partition("; ")[2] == units["note"].partition("; ")[2]


def test_the_first_layer_of_the_coupon_is_drawn_in_as_that_of_units() -> None:
    printing = {"first_layer_inset": "0.2 mm", "layer": "0.3 mm"}
    settings = Fabrication.model_validate({"print": printing}, context=SIM_UNITS)
    part = coupon(settings)
    first, second, top = coupon_solid(part, settings).layers
    assert (first.bottom, first.top, second.top) == (0.0, 0.3, top.bottom)
    assert first.area.equals(part.outline.buffer(-0.2, join_style="mitre"))
    assert second.area.equals(part.outline)
    assert len(coupon_solid(part, Fabrication()).layers) == 2


def test_each_clearance_of_the_coupon_is_told_apart_and_has_room() -> None:
    given = {"coupon": ["0.02 mm", "0.025 mm", "0.03 mm", "0.0508 mm"]}
    settings = Fabrication.model_validate(given, context=SIM_UNITS)
    words = [_clearance_words(clearance) for clearance in settings.coupon]
    assert words == ["0.02", "0.025", "0.03", "0.0508"]
    assert max(text_extent(word, 2.6)[0] for word in words) < _COUPON_PITCH
