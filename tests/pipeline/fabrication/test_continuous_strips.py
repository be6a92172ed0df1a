from dataclasses import replace

import numpy as np
import pytest

from pipeline.fabrication.fixtures import fixtures, strip_parts
from pipeline.fabrication.fixtures.flat_fixtures import strips
from pipeline.fabrication.parts import BuiltSpecimen
from tests.pipeline.fabrication import handmade


def without(specimen: BuiltSpecimen, label: str) -> BuiltSpecimen:
    """The specimen with a void of one unit."""
    return replace(
        specimen,
        units=tuple(unit for unit in specimen.units if unit.label != label),
        ligaments=tuple(one for one in specimen.ligaments if label not in one.labels),
    )


def test_a_strip_follows_each_row_and_each_column_and_is_as_long() -> None:
    specimen = handmade.specimen()
    found = dict(strips(specimen))
    assert list(found) == ["COLUMN1", "COLUMN2", "COLUMN3", "ROW1", "ROW2"]
    row = found["ROW1"]
    assert len(row) == 8  # two ligaments, each from slot end to mouth to mouth to slot end
    assert (np.diff(row[:, 0]) > 0).all()
    part = next(part for part in strip_parts(specimen, handmade.ASKED) if part.id == "ROW1")
    length = np.linalg.norm(np.diff(row, axis=0), axis=1).sum()
    assert part.size == pytest.approx((length, handmade.ASKED.thickness))
    assert len(part.scores) == len(row) - 2
    without_one = strips(without(specimen, "B1"))
    assert [name for name, _ in without_one] == ["COLUMN1", "COLUMN3", "ROW2"]


def test_a_row_that_a_void_interrupts_has_two_strips(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(handmade, "COLUMNS", 5)
    found = dict(strips(without(handmade.specimen(), "C1")))
    assert [name for name in found if name.startswith("ROW")] == ["ROW1-1", "ROW1-2", "ROW2"]
    left, right = found["ROW1-1"], found["ROW1-2"]
    assert left[:, 0].max() < 2 * handmade.SPACING < right[:, 0].min()


def test_jaws_stand_back_from_the_rim() -> None:
    specimen = handmade.specimen()
    parts = {part.id: part for part in fixtures(specimen, handmade.ASKED, handmade.SPACING)}
    clamps = [
        part for name, part in parts.items() if name.startswith("CLAMP") and "LID" not in name
    ]
    assert clamps
    for clamp in clamps:
        _, base, jaws = (layer.area for layer in clamp.layers)
        assert base.contains(jaws)
        assert base.boundary.distance(jaws) > 0.01
