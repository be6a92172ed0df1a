"""The block that tries clearances of slots holds together, however deep these are."""

import pytest

from pipeline.fabrication.fixtures.flat_fixtures import coupon
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication


@pytest.mark.parametrize("depth", [4.0, 9.0, 16.0])
def test_slots_end_inside_the_coupon(depth: float) -> None:
    slots = {"depth": depth, "depth_max": max(depth, 9.0)}
    settings = Fabrication.model_validate({"slots": slots}, context=SIM_UNITS)
    outline = coupon(settings).outline
    low, high = outline.bounds[1::2]
    assert outline.is_valid
    assert high - low >= depth + 5.0
    assert len(outline.exterior.coords) == 5 + 4 * len(settings.coupon)
