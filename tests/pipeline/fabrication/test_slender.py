from types import SimpleNamespace
from typing import cast

import pytest
from shapely import MultiPolygon, Polygon

from pipeline.fabrication.checks.assembled_specimen import unit_sections
from pipeline.fabrication.checks.package_record import ExpectedParts
from pipeline.fabrication.checks.slot_checks import UnitSection, check_section
from pipeline.fabrication.parts import UnbuildableUnitError
from pipeline.fabrication.readback import MeshBody
from pipeline.problem.sections import Fabrication
from tests.pipeline.fabrication import slender

SETTINGS = Fabrication()


@pytest.mark.parametrize("name", slender.UNITS)
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
    expected = ExpectedParts({"A1": thin, "A2": beside}, ())
    sections = unit_sections(cast("MeshBody", solid), expected, SETTINGS)
    assert sections["A1"].equals(grown)
    assert sections["A2"].equals(beside)


def test_a_unit_without_room_for_its_id_carries_a_letter() -> None:
    name = next(name for name, data in slender.UNITS.items() if data["label"] == "AD15")
    assert slender.built(name).letter == "A"
    assert slender.built(name, letters="YV").letter == "Y"
    with pytest.raises(UnbuildableUnitError, match="no room for the id of unit AD15"):
        slender.built(name, letters="")
