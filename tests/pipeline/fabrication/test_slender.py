"""Slender units of optimised designs, each of which once stopped an export."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shapely import MultiPolygon, Polygon

from pipeline.fabrication.checks import assembled_specimen, slot_checks
from pipeline.fabrication.checks.expected_parts import Wanted
from pipeline.fabrication.checks.slot_checks import MadeOutline
from pipeline.fabrication.engraving.read_strokes import read
from pipeline.fabrication.parts import LETTERS, Unit, UnmadeError
from pipeline.fabrication.units.slot_candidates import Corner
from pipeline.fabrication.units.specimen_units import unit
from pipeline.fabrication.units.unit_network import UnitNetwork
from pipeline.problem.sections import Fabrication

FILE = Path(__file__).parents[2] / "data/slender_units.json"
SLENDER = json.loads(FILE.read_text(encoding="utf-8"))
NAMES = [f"{found['study']} {found['label']}" for found in SLENDER]
ASKED = Fabrication()


def made(found: dict[str, Any], letters: str = LETTERS) -> Unit:
    """The unit beside its neighbours, some of which have grown."""
    net = UnitNetwork(
        (0,), {0: Polygon(found["corners"])}, {0: found["label"]}, {0: (0, 0)}, (), (), ()
    )
    slotted = [
        Corner(vertex, number, np.array(along))
        for number, (vertex, *along) in enumerate(found["slots"])
    ]
    neighbours = [Polygon(ring) for ring in found["neighbours"]]
    return unit(net, 0, slotted, neighbours, ASKED, FILE, letters)[0]


@pytest.mark.parametrize("found", SLENDER, ids=NAMES)
def test_a_slender_unit_is_made_without_a_fault(found: dict[str, Any]) -> None:
    one = made(found)
    vertices = [vertex for vertex, *_ in found["slots"]]
    shape = MadeOutline(one.label, FILE, one.design, one.outline, vertices)
    assert [fault.what for fault in slot_checks.check(shape, ASKED)] == []
    gaps = [one.outline.distance(Polygon(ring)) for ring in found["neighbours"]]
    assert min(gaps, default=1.0) >= ASKED.minimum_gap - 1e-4


def test_a_unit_that_grew_to_twice_its_size_is_found_in_its_place() -> None:
    """Less than half of it covers its design."""
    thin, beside = Polygon([(0, 0), (9, 0), (9, 1), (0, 1)]), Polygon([(0, 4), (9, 4), (9, 9)])
    grown = thin.buffer(1.0, join_style="mitre")
    solid = SimpleNamespace(section=lambda _height: MultiPolygon([beside, grown]))
    found = assembled_specimen.shapes(solid, Wanted({"A1": thin, "A2": beside}, {}, ()), ASKED)  # type: ignore[arg-type]
    assert found["A1"].equals(grown)
    assert found["A2"].equals(beside)


def test_a_unit_without_room_for_its_id_carries_a_letter() -> None:
    found = next(found for found in SLENDER if found["label"] == "AD15")
    one = made(found)
    assert one.letter == "A"
    assert read("A", one.lettering + one.mark) is not None
    assert read("AD15", one.lettering + one.mark) is None
    taken = made(found, letters="YV")
    assert taken.letter == "Y"
    with pytest.raises(UnmadeError, match="no room for the id of unit AD15"):
        made(found, letters="")
