"""The teeth of the comb stand where the ligaments of a row do, or there is one alone."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.fabrication.fixtures import comb
from pipeline.fabrication.parts import BuiltSpecimen
from sim.core import Floats
from tests.pipeline.fabrication import handmade

GAP = 2.25


def teeth(specimen: BuiltSpecimen) -> Floats:
    """Middles (n,) of the teeth, mm."""
    points = np.asarray(
        comb(specimen, handmade.SPACING, GAP, handmade.ASKED).outline.exterior.coords
    )
    tips = np.unique(points[points[:, 1] == points[:, 1].max(), 0])
    assert np.diff(tips)[::2] == pytest.approx(GAP)
    return (tips[::2] + tips[1::2]) / 2


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
