"""Outlines come back from their sheets to where the design has the unit."""

from __future__ import annotations

import numpy as np
import pytest
from shapely.affinity import translate

from pipeline.fabrication.readback import aligned
from tests.pipeline.fabrication import handmade


@pytest.mark.parametrize("number", range(6))
def test_a_slotted_unit_is_brought_back(number: int) -> None:
    unit = handmade.specimen().units[number]
    back = aligned(unit.design, translate(unit.outline, 123.4, -56.7))
    np.testing.assert_allclose(back.bounds, unit.outline.bounds, atol=1e-6)


def test_a_thickened_corner_does_not_count() -> None:
    unit = handmade.specimen().units[0]
    slot = unit.slots[0]
    lug = handmade.box_along(slot.end + 3 * slot.direction, slot.end - slot.direction, 7.0)
    thick = unit.outline.union(lug.difference(unit.design).intersection(unit.design.buffer(0.5)))
    back = aligned(unit.design, translate(thick, 40.0, 3.0))
    np.testing.assert_allclose(back.bounds, thick.bounds, atol=1e-3)
