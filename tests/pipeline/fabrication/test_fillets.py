"""Rounded corners are no fault of a unit, however sharp they were designed."""

from pathlib import Path

import numpy as np
import pytest
from shapely import Polygon

from pipeline.fabrication.checks.slot_checks import UnitSection, check_section
from pipeline.fabrication.units.unit_outlines import filleted
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication


def wedge(angle: float) -> Polygon:
    """An isosceles triangle with legs of 20 mm, rad."""
    x, y = 20.0 * np.cos(angle / 2), 20.0 * np.sin(angle / 2)
    return Polygon([(0.0, 0.0), (x, -y), (x, y)])


@pytest.mark.parametrize("angle", [12.0, 20.0, 60.0, 120.0])
def test_material_lost_to_a_fillet_is_no_fault(angle: float) -> None:
    asked = Fabrication.model_validate({"fillet_radius": "0.5 mm"}, context=SIM_UNITS)
    design = wedge(np.deg2rad(angle))
    section = UnitSection("A1", Path("a.stl"), design, filleted(design, 0.5), [])
    assert [fault.what for fault in check_section(section, asked)] == []
    rounder = UnitSection("A1", Path("a.stl"), design, filleted(design, 0.9), [])
    assert [fault.key for fault in check_section(rounder, asked)] == ["slots.depth_max"]
