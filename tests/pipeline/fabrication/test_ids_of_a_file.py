"""Units of a lattice from a file have no columns and rows: no paper speaks of them."""

from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.fabrication.checks.package_check import page_words
from pipeline.fabrication.fixtures.flat_fixtures import comb
from pipeline.fabrication.papers import bill_rows, write_assembly_sheet
from pipeline.fabrication.papers.assembly_sheet import assembly_steps
from pipeline.fabrication.parts import BuiltSpecimen, labels
from tests.pipeline.fabrication import handmade
from tests.pipeline.fabrication.handmade import ASKED


@pytest.fixture(scope="module")
def listed() -> BuiltSpecimen:
    """The six squares as a file lists them: indices (0, 0), (1, 0), ..."""
    one = handmade.specimen()
    names = labels([(number, 0) for number in range(len(one.units))])
    renamed = dict(zip((unit.label for unit in one.units), names, strict=True))
    units = tuple(
        replace(unit, label=name, column=number, row=0)
        for number, (unit, name) in enumerate(zip(one.units, names, strict=True))
    )
    ligaments = tuple(
        replace(each, labels=(renamed[each.labels[0]], renamed[each.labels[1]]))
        for each in one.ligaments
    )
    return replace(one, units=units, ligaments=ligaments, clamped=(), driven=())


def test_ids_tell_places_where_units_stand_in_rows(listed: BuiltSpecimen) -> None:
    one = handmade.specimen()
    assert one.in_rows
    assert replace(one, units=one.units[:3]).in_rows
    assert not listed.in_rows
    jumbled = (replace(one.units[0], column=5), *one.units[1:3])
    assert not replace(one, units=jumbled).in_rows


def test_papers_leave_columns_and_rows_out(listed: BuiltSpecimen, tmp_path: Path) -> None:
    steps = " ".join(assembly_steps(listed, ASKED, []))
    assert "in the order of the lattice's file" in steps
    for words in ("row by row", "column by column", "for the column"):
        assert words not in steps
    write_assembly_sheet(tmp_path / "sheet.pdf", listed, ASKED)
    (plan,) = (page for page in page_words(tmp_path / "sheet.pdf") if "1:1" in page[0])
    assert {"A1", "F1"} <= set(plan)
    assert not set("ABCDEF") & set(plan)
    rows = list(bill_rows(listed, ASKED, 1e-9, {}, {}, 0.5))
    assert rows[3].note.startswith("number 4 in the lattice's file; ")
    assert not any(row.id.startswith("strips") for row in rows)


def test_the_comb_has_one_tooth_where_there_are_no_rows(listed: BuiltSpecimen) -> None:
    assert comb(listed, handmade.SPACING, ASKED).size[0] == handmade.SPACING
    assert comb(handmade.specimen(), handmade.SPACING, ASKED).size[0] > handmade.SPACING
