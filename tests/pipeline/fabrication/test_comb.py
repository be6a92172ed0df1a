"""The teeth of the comb stand where the ligaments of a row do, or there is one alone."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.fabrication.fixtures import comb
from pipeline.fabrication.parts import BuiltSpecimen
from sim.core import Floats
from tests.pipeline.fabrication import handmade


def tips(specimen: BuiltSpecimen) -> Floats:
    """Lists where the tips of the teeth begin and end (n, 2), mm."""
    drawn = comb(specimen, handmade.SPACING, handmade.ASKED)
    points = np.asarray(drawn.outline.exterior.coords)
    return np.unique(points[points[:, 1] == points[:, 1].max(), 0]).reshape(-1, 2)


def teeth(specimen: BuiltSpecimen) -> Floats:
    """Lists the middles (n,) of the teeth, mm."""
    return tips(specimen).mean(axis=1)


def changed(scale: float, turn: float) -> BuiltSpecimen:
    """The six squares, their ligaments nearer along x and turned."""
    one = handmade.specimen()
    ways = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    units = tuple(
        replace(unit, slots=tuple(replace(slot, mouth=ways @ slot.mouth) for slot in unit.slots))
        for unit in one.units
    )
    ligaments = tuple(
        replace(each, middle=(scale * each.middle[0], each.middle[1])) for each in one.ligaments
    )
    return replace(one, units=units, ligaments=ligaments)


def test_teeth_fill_the_gaps_between_units_as_they_are_cut() -> None:
    """Units are cut back beside slots: the gap is wider than the ligament as designed."""
    one = handmade.specimen()
    gap = one.by_label["A1"].outline.distance(one.by_label["B1"].outline)
    assert gap > one.by_label["A1"].design.distance(one.by_label["B1"].design) + 0.1
    assert np.diff(tips(one))[:, 0] == pytest.approx(gap, abs=0.005)


@pytest.mark.parametrize("pitch", [15.0, 11.0, 7.5])
def test_teeth_have_the_pitch_of_the_ligaments(pitch: float) -> None:
    assert np.diff(teeth(changed(pitch / handmade.SPACING, 0.0))) == pytest.approx([pitch])


@pytest.mark.parametrize(("scale", "turn"), [(0.5, np.pi / 6), (1.0, 0.3), (0.2, 0.0)])
def test_a_single_tooth_measures_ligaments_that_no_row_of_teeth_fits(
    scale: float, turn: float
) -> None:
    """Such as those of a kagome lattice, which lean against the rows, or of units side by side."""
    assert len(teeth(changed(scale, turn))) == 1


def test_teeth_stand_only_where_ligaments_follow_one_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ligaments of five units in a row; that of the second and the third is out of place."""
    monkeypatch.setattr(handmade, "COLUMNS", 5)
    one = handmade.specimen()
    ligaments = tuple(
        replace(each, middle=(each.middle[0] + 2.0, each.middle[1])) if "B" in each.name else each
        for each in one.ligaments
    )
    assert len(teeth(one)) == 4
    assert len(teeth(replace(one, ligaments=ligaments))) == 2
