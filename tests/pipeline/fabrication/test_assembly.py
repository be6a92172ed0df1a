import dataclasses
import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
import shapely

from pipeline import problem
from pipeline.fabrication.checks.package_check import page_words
from pipeline.fabrication.papers import (
    bill_rows,
    read_bill,
    write_assembly_sheet,
    write_bill,
    write_manifest,
)
from pipeline.fabrication.papers.assembly_plan import _DIGIT, _NUMBER, OVERLAP, tiles
from pipeline.fabrication.papers.assembly_sheet import assembly_steps
from pipeline.fabrication.papers.label_places import name_box, name_places, number_places
from pipeline.fabrication.papers.pdf_paper import POINT, SIZES, room
from pipeline.fabrication.parts import BuiltSpecimen, Circle
from pipeline.fabrication.plates import PrintEstimate
from sim.core import Floats
from tests.pipeline.fabrication import built, handmade
from tests.pipeline.fabrication.handmade import ASKED
from tests.tables import refused

DOT = Circle((0.0, 0.0), 2.0)
DENSITY = 6.18e-9  # tonne/mm^2
PROBLEM = Path(__file__).parents[3] / "experiments/fig2/problem.yaml"


def written(folder: Path, specimen: BuiltSpecimen | None = None) -> Path:
    path = folder / "assembly.pdf"
    write_assembly_sheet(path, specimen or handmade.specimen(), ASKED)
    return path


def test_the_pages_name_every_unit_shim_and_fixture(tmp_path: Path) -> None:
    pages = page_words(written(tmp_path))
    for number, page in enumerate(pages, 1):
        assert page[1] == str(number)
        assert page[2].startswith("100 mm: measure")
    (plan,) = (page for page in pages if "1:1" in page[0])
    assert {"A1", "B1", "C1", "A2", "B2", "C2", "A", "B", "C", "1", "2"} <= set(plan)
    (shims,) = (page for page in pages if "shims" in page[0])
    assert "shims: 8 pieces of 1 length" in shims[0]
    assert {"S8.25", "8.25 mm", "8.10 mm", "7", "1", "8"} <= set(shims)
    assert "Set the clamped units into their pads, grips or adapters: A1, C2." in " ".join(pages[0])
    steps = [words for words in pages[0] if words.rstrip(".").isdigit()]
    assert steps[1:] == [f"{number}." for number in range(1, 16)]  # after the page's own


def test_two_kinds_of_shims_are_told_apart_by_ligament(tmp_path: Path) -> None:
    one = handmade.specimen()
    (kind,) = one.shims
    other = dataclasses.replace(kind, id="S9.00", length=9.0, ligaments=(6,))
    kinds = (dataclasses.replace(kind, ligaments=tuple(range(6))), other)
    found = page_words(written(tmp_path, dataclasses.replace(one, shims=kinds)))
    assert "units that are not joined by shim S8.25" in found[-1][0]
    last = found[-1].index("B2 - C2")
    assert found[-1][last + 1 : last + 3] == ["2", "S9.00"]


@pytest.mark.parametrize("paper", ["A4", "Letter"])
@pytest.mark.parametrize("size", [40.0, 190.0, 240.75, 483.0])
def test_tiles_fit_the_paper_and_cover_the_drawing(paper: str, size: float) -> None:
    width, height = SIZES[paper]  # type: ignore[index]
    page = room(width, height)[2:]
    found = tiles((-5.0, -7.0, size, size), page)
    for tile in found:
        assert tile.window[2] <= page[0] + 1e-9
        assert tile.window[3] <= page[1] + 1e-9
    left = min(tile.window[0] for tile in found)
    right = max(tile.window[0] + tile.window[2] for tile in found)
    low = min(tile.window[1] for tile in found)
    assert (left, right, low) == pytest.approx((-5.0, size - 5.0, -7.0))
    assert len({tile.name for tile in found}) == len(found)


def test_neighbouring_tiles_share_a_strip_and_its_middle_line() -> None:
    first, second = tiles((0.0, 0.0, 300.0, 100.0), (190.0, 240.0))
    assert first.window[0] + first.window[2] - second.window[0] == pytest.approx(OVERLAP)
    (mine,), (other,) = list(first.joints()), list(second.joints())
    assert mine[0] == other[0] == "x"
    assert mine[1] == pytest.approx(other[1])


def test_steps_tell_what_the_lines_of_a_drawing_are() -> None:
    (step,) = (s for s in assembly_steps(handmade.specimen(), ASKED, []) if "laser/" in s)
    for words in (
        "green engraves, red scores, blue cuts holes, then black cuts out",
        "switch grey off",
        "layer REFERENCE",
    ):
        assert words in step


BOTH = (
    "laser/units_sheet1_nominal.dxf",
    "laser/coupon_sheet1_nominal.dxf",
    "print/units_plate1.3mf",
    "print/coupon_plate1.3mf",
)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 20.0])
def test_papers_tell_to_print_units_or_to_cut_them(ratio: float) -> None:
    laser = ASKED.laser.model_copy(update={"aspect_ratio": ratio})
    settings, specimen = ASKED.model_copy(update={"laser": laser}), handmade.specimen()
    others = ("laser/comb_sheet1_nominal.dxf", "fixture/fixture_plate1.3mf")
    contents = {name: ["A1"] for name in (*BOTH, *others)}
    prints = {name: PRINTS["print/plate_01.3mf"] for name in contents if name.endswith("3mf")}
    rows = bill_rows(specimen, settings, DENSITY, contents, prints, 0.62)
    notes = {row.id: row.note for row in rows if row.item in {"sheet", "plate", "fixture", "pin"}}
    told = [name for name, note in notes.items() if "print units and coupon or cut them" in note]
    pins = ["PIN1.5"] * (ratio == 3.0)
    assert told == ([] if ratio == 1.0 else [*BOTH, *pins])
    steps = " ".join(assembly_steps(specimen, settings, []))
    assert ("Print the units and the coupon, or cut them: not both" in steps) == (ratio > 1.0)
    assert ("Print the units and the coupon: no laser cuts" in steps) == (ratio == 1.0)


VARIANTS = ("nominal", "kerf0.15")


@pytest.mark.parametrize("kerf", [0.15, 0.0])
def test_papers_tell_that_sheets_of_a_kerf_replace_nominal_ones(kerf: float) -> None:
    laser = ASKED.laser.model_copy(update={"kerf": kerf})
    settings, specimen = ASKED.model_copy(update={"laser": laser}), handmade.specimen()
    names = [f"laser/comb_sheet1_{variant}.dxf" for variant in ("nominal", f"kerf{kerf:g}")]
    contents = {name: ["COMB"] for name in (names if kerf else names[:1])}
    rows = bill_rows(specimen, settings, DENSITY, contents, {}, 0.62)
    notes = {row.id: row.note for row in rows if row.item == "sheet"}
    steps = " ".join(assembly_steps(specimen, settings, []))
    if not kerf:
        assert notes == {names[0]: "1 part"}
        assert "nominal" not in steps
        return
    assert notes[names[0]] == "1 part; at nominal size: cut it or the sheets of kerf0.15, not both"
    assert notes[names[1]] == "1 part; kerf made good: cut it or the nominal sheets, not both"
    assert "Cut either the drawings _nominal or those _kerf0.15" in steps


def test_sheets_that_no_laser_cuts_are_in_place_of_no_others(tmp_path: Path) -> None:
    """Units and coupon that are printed only are drawn for reference, at nominal size."""
    built.write(tmp_path / "cloaked", {"laser": {"aspect_ratio": 1.0}})
    notes = {row["id"]: row["note"] for row in read_bill(tmp_path / "cloaked/bom.csv")}
    for kind in ("units", "coupon"):
        (name,) = (name for name in notes if name.startswith(f"laser/{kind}_"))
        assert name.endswith("_nominal.dxf")
        assert "cut it" not in notes[name]
        assert "print only" in notes[name]
    combs = [name for name in notes if name.startswith("laser/comb_")]
    assert combs == [f"laser/comb_sheet1_{variant}.dxf" for variant in VARIANTS]


def test_shims_on_tabs_are_never_cut_at_nominal_size() -> None:
    """Lines from tab to tab are open: no cutter makes a kerf good on them."""
    specimen, names = handmade.specimen(), [f"laser/shims_sheet1_{v}.dxf" for v in VARIANTS]
    free = ASKED.model_copy(update={"shims": ASKED.shims.model_copy(update={"tabs": None})})
    for settings, told in ((ASKED, True), (free, False)):
        rows = bill_rows(specimen, settings, DENSITY, {name: ["S"] for name in names}, {}, 0.62)
        nominal, compensated = (row.note for row in rows if row.item == "sheet")
        assert ("do not cut it: its lines, from tab to tab, are open" in nominal) == told
        assert ("kerf made good: cut it, not the nominal sheets" in compensated) == told
        steps = " ".join(assembly_steps(specimen, settings, []))
        assert ("Of shims, which hang on tabs, cut those _kerf0.15 on any cutter" in steps) == told


PRINTS = {"print/plate_01.3mf": PrintEstimate(3900.0, 2000.0)}


def test_the_bill_lists_units_shims_files_and_totals(tmp_path: Path) -> None:
    specimen = handmade.specimen()
    *others, last = specimen.units
    slots = tuple(dataclasses.replace(slot, wall=0.7) for slot in last.slots)
    thin = dataclasses.replace(last, slots=slots)
    specimen = dataclasses.replace(specimen, units=(*others, thin))
    contents = {
        "laser/units_01_nominal.dxf": [unit.label for unit in specimen.units],
        "laser/shims_01_nominal.dxf": ["S8.25"],
        "print/plate_01.3mf": ["A1", "B1"],
    }
    rows = bill_rows(specimen, ASKED, DENSITY, contents, PRINTS, 0.62)
    write_bill(tmp_path / "bom.csv", rows)
    found = read_bill(tmp_path / "bom.csv")
    units = [row["id"] for row in found if row["item"] == "unit"]
    assert units == [unit.label for unit in specimen.units]
    first = found[0]
    assert first["note"] == "column 1 row 1; slots 3 3 mm deep; walls from 1.00 mm"
    assert specimen.thin == {"C2": 0.7}
    assert found[5]["note"].endswith("; walls from 0.70 mm (thin)")
    (pin,) = (row for row in found if row["item"] == "pin")
    none = "no room for a pin: the jig alone aligns: A1, B1, C1, A2, B2, C2"
    told = (
        f"aligns 6 layers; {none}; 2 for the coupon; print units and coupon or cut them, not both"
    )
    assert pin["note"] == told
    assert first["files"] == "laser/units_01_nominal.dxf print/plate_01.3mf"
    area = specimen.units[0].design.area
    assert float(first["mass_g"]) == pytest.approx(area * 6.18e-3, abs=1e-4)  # kg/m^2 = mg/mm^2
    assert float(first["volume_mm3"]) == pytest.approx(specimen.units[0].outline.area * 8.1)
    (shim,) = (row for row in found if row["item"] == "shim")
    assert (shim["count"], shim["length_mm"], shim["width_mm"]) == ("8", "8.2500", "8.1000")
    foil = 8.25e-3 * 8.1e-3 * ASKED.shims.thickness * 1e-3 * 1380.0  # kg, of 1380 kg/m^3
    assert float(shim["mass_g"]) == pytest.approx(1e3 * foil, abs=1e-4)
    files = [(row["item"], row["count"]) for row in found if "/" in row["id"]]
    assert files == [("sheet", "6"), ("sheet", "1"), ("plate", "1")]  # units are cut in six layers
    total = next(row for row in found if row["item"] == "total")
    masses = [float(row["mass_g"]) for row in found if row["item"] == "unit"]
    assert float(total["mass_g"]) == pytest.approx(sum(masses), abs=1e-3)
    solid = 1e6 * float(total["volume_mm3"]) * ASKED.solid_density
    told = f"; at the density that is simulated{', more than solid' * (sum(masses) > solid)}"
    told += f"; {solid:.1f} g if solid, about 6 g as printed with walls and 62 % infill"
    assert total["note"] == ASKED.material + told
    plate = next(row for row in found if row["item"] == "plate")
    assert plate["note"] == "2 parts; about 1 h 05 min, 2.0 m or 6 g"
    # 8 rectangles of 32.7 mm, each on two tabs of 0.4 mm; 2 rows and 3 columns, scored 18 times
    assert [(row["id"], row["count"], row["note"]) for row in found if row["item"] == "foil"] == [
        ("free pieces", "8", "8 cuts of 0.26 m, about 0.5 min; for comparison, not drawn"),
        ("sheets of pieces on tabs", "1", "16 cuts of 0.26 m, about 0.6 min; drawn"),
        (
            "strips, one a row and a column",
            "5",
            "23 cuts of 0.35 m, about 0.8 min; for comparison, not drawn",
        ),
    ]
    prints = found[-1]
    assert (prints["id"], prints["count"]) == ("prints", "1")
    assert float(prints["mass_g"]) == pytest.approx(2000 * np.pi / 4 * 1.75**2 * 1.24e-3, rel=1e-4)
    (tmp_path / "bom.csv").write_bytes(b"item,id\nunit,\xff\n")
    with refused("the bill of materials that was just written cannot be read back"):
        read_bill(tmp_path / "bom.csv")


def test_the_manifest_holds_parameters_and_hashes(tmp_path: Path) -> None:
    asked = problem.load(PROBLEM)
    design = tmp_path / "design.nc"
    design.write_bytes(b"a design")
    package = tmp_path / "package"
    (package / "laser").mkdir(parents=True)
    (package / "laser/a.dxf").write_bytes(b"drawing")
    for _ in range(2):  # a manifest does not count itself
        write_manifest(package, handmade.specimen(), asked, design)
    told = json.loads((package / "manifest.json").read_text())
    assert told["files"] == {"laser/a.dxf": hashlib.sha256(b"drawing").hexdigest()}
    assert told["design_sha256"] == hashlib.sha256(b"a design").hexdigest()
    assert told["parameters"]["shims"]["thickness"] == 0.25
    assert told["units"] == ["A1", "B1", "C1", "A2", "B2", "C2"]


@pytest.mark.parametrize(("paper", "width"), [("A4", b"595.27"), ("Letter", b"612 ")])
def test_pages_have_the_size_that_is_asked_for(tmp_path: Path, paper: str, width: bytes) -> None:
    path = tmp_path / "assembly.pdf"
    write_assembly_sheet(path, handmade.specimen(), ASKED.model_copy(update={"paper": paper}))
    assert b"/MediaBox [ 0 0 " + width in path.read_bytes()


SIZE = (3.4, 2.4)


def test_a_digit_is_high_enough_on_paper() -> None:
    assert _DIGIT[1] * _NUMBER / POINT >= 1.8


@pytest.mark.parametrize("spacing", [2.0, 5.0])
def test_numbers_of_close_shims_cover_neither_each_other_nor_ids(spacing: float) -> None:
    middles = {k: np.array([spacing * (k % 3), spacing * (k // 3)]) for k in range(9)}
    paths = {k: np.add(middle, [[-1.0, 0.0], [1.0, 0.0]]) for k, middle in middles.items()}
    taken = [(-2.0, 0.5, 2.0, 2.5)]
    found = number_places(middles, dict.fromkeys(middles, SIZE), paths, taken)
    boxes = [box_around(np.array(spot)) for spot in found.values()] + [shapely.box(*taken[0])]
    shared = [a.intersection(b).area for k, a in enumerate(boxes) for b in boxes[:k]]
    assert np.max(shared) < 1e-9
    if spacing == 5.0:  # with room each stands by its own shim, on the line of no other
        for number, spot in found.items():
            assert np.linalg.norm(np.array(spot) - middles[number]) < 3.0
            box = box_around(np.array(spot))
            lines = (shapely.LineString(path) for k, path in paths.items() if k != number)
            assert not any(line.intersects(box) for line in lines)


def test_ids_of_narrow_units_side_by_side_do_not_cover_each_other() -> None:
    units = [shapely.box(left, 0.0, left + 3.0, 9.0) for left in (0.0, 3.5)]
    names = ["AD15", "AE15"]
    places = name_places(units, names, [], [])
    boxes = [shapely.box(*name_box(*pair)) for pair in zip(names, places, strict=True)]
    assert boxes[0].intersection(boxes[1]).area < 1e-9
    for unit, box in zip(units, boxes, strict=True):
        assert unit.contains(box.centroid)


def test_an_id_stands_clear_of_shims_and_of_its_arrow() -> None:
    """Slots of a triangle end where it is widest."""
    unit = shapely.Polygon([(0.0, 0.0), (8.0, 0.0), (0.0, 9.0)])
    path, arrow = np.array([[2.5, 2.0], [2.0, 3.2]]), (0.2, 4.5, 1.0, 6.0)
    (place,) = name_places([unit], ["C7"], [path], [arrow])
    box = shapely.box(*name_box("C7", place))
    assert unit.contains(box)
    assert not box.intersects(shapely.LineString(path))
    assert not box.intersects(shapely.box(*arrow))


def test_an_id_that_nothing_covers_is_where_its_unit_is_widest() -> None:
    square = shapely.box(0.0, 0.0, 12.0, 12.0)
    path = np.array([[0.0, 0.0], [2.0, 2.0]])
    (place,) = name_places([square], ["C7"], [path], [])
    assert place == pytest.approx((6.0, 6.0, 6.5), abs=0.05)


def test_papers_name_the_units_without_a_dot() -> None:
    whole = handmade.specimen()
    first, *others = whole.units
    bare = dataclasses.replace(whole, units=(dataclasses.replace(first, markers=()), *others))
    dotted = [dataclasses.replace(unit, markers=(DOT,)) for unit in bare.units[1:]]
    bare = dataclasses.replace(bare, units=(bare.units[0], *dotted))
    full = dataclasses.replace(bare, units=(dataclasses.replace(first, markers=(DOT,)), *dotted))
    for specimen, named in ((bare, True), (full, False)):
        rows = bill_rows(specimen, ASKED, DENSITY, {}, {}, 0.62)
        (note,) = (row.note for row in rows if row.item == "dot")
        assert ("; no room for one on 1 unit: A1" in note) == named
        steps = " ".join(assembly_steps(specimen, ASKED, []))
        assert ("1 unit has no room for a dot: A1." in steps) == named


def box_around(spot: Floats) -> shapely.Polygon:
    half = np.array(SIZE) / 2
    return shapely.box(*(spot - half), *(spot + half))
