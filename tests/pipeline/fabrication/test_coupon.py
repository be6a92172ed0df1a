"""The block that tries clearances of slots holds together, however deep these are."""

from pathlib import Path

import pytest
import shapely

from pipeline.fabrication.fixtures.flat_fixtures import coupon
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
