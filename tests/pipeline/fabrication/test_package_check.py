"""A whole package passes its checks as written, and fails them once any file of it is damaged."""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import pytest
import shapely
import trimesh
from ezdxf.filemanagement import readfile

from pipeline.datasets import file_hash
from pipeline.fabrication.checks import (
    check_package,
    laser_folder,
    package_record,
    print_folder,
)
from pipeline.fabrication.checks.assembled_specimen import unit_sections
from pipeline.fabrication.checks.bill_checks import check_bill
from pipeline.fabrication.checks.package_record import PackageRecord, expected_parts
from pipeline.fabrication.checks.sheet_checks import check_scale
from pipeline.fabrication.files.drawing_files import LAYER_COLOURS, write_dxf, write_svg
from pipeline.fabrication.papers import BILL, MANIFEST, read_bill
from pipeline.fabrication.plates import LaserSheet
from pipeline.fabrication.readback import Drawing, faults, read_drawing, read_stl
from pipeline.problem import Problem
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication
from pipeline.runtime import UserError
from tests.pipeline.fabrication import built, handmade
from tests.pipeline.fabrication.files import write_stl
from tests.tables import cases, some, tables

UNITS = "laser/units_sheet1_nominal"
KERF = "laser/units_sheet1_kerf0.15"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Problem]:
    folder = tmp_path_factory.mktemp("whole") / "cloaked"
    return folder, built.write(folder)


@pytest.fixture
def package(whole: tuple[Path, Problem], tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole[0], tmp_path / "cloaked"))


@pytest.fixture(autouse=True, scope="module")
def each_drawing_is_read_once_and_no_fault_drawn() -> Iterator[None]:
    """Keeps drawings by their bytes: a damage leaves most files of a package as they were."""
    known: dict[tuple[str, bytes], Drawing] = {}

    def read(path: Path) -> Drawing:
        key = (path.suffix, path.read_bytes() if path.exists() else b"")
        if key not in known:
            known[key] = read_drawing(path)
        return replace(known[key], file=path)

    with pytest.MonkeyPatch.context() as patch:
        for module in (laser_folder, package_record):
            patch.setattr(module, "read_drawing", read)
        patch.setattr(faults, "draw", lambda *words: words[-1])  # test_faults.py looks at pictures
        yield


def refused(package: Path, asked: Problem) -> str:
    """What the checks say to a package whose manifest tells of its files as they are."""
    path = package / MANIFEST
    if path.exists():
        told = json.loads(path.read_text())
        files = [file for file in package.rglob("*") if file.is_file() and file != path]
        told["files"] = {f.relative_to(package).as_posix(): file_hash(f) for f in files}
        path.write_text(json.dumps(told))
    with pytest.raises(UserError) as raised:
        check(package, asked)
    return str(raised.value)


def check(package: Path, asked: Problem) -> None:
    pictures = package.with_name("faults")
    check_package(package, built.design(), "cloaked", asked.fabrication, pictures)


def edited(name: str, before: str, after: str, count: int = 1) -> Callable[[Path], None]:

    def damage(package: Path) -> None:
        text = (package / name).read_text(encoding="utf-8")
        assert before in text
        (package / name).write_text(text.replace(before, after, count), encoding="utf-8")

    return damage


def gone(pattern: str) -> Callable[[Path], None]:
    def damage(package: Path) -> None:
        for path in package.glob(pattern):
            path.unlink()

    return damage


def copied(name: str, to: str) -> Callable[[Path], None]:
    def damage(package: Path) -> None:
        shutil.copy(package / name, package / to)

    return damage


def without_id(package: Path) -> None:
    """A unit whose underside is plain."""
    path = package / "print/units/A1.stl"
    body = trimesh.creation.extrude_polygon(read_stl(path).section(4.0), 8.1, engine="earcut")
    write_stl(path, np.asarray(body.vertices), np.asarray(body.faces))


def without_bolt(package: Path) -> None:
    """A base of a clamp that is whole."""
    path = package / "fixture/CLAMP-A1.stl"
    base = read_stl(path).section(3.0)
    whole = shapely.Polygon(shapely.get_exterior_ring(base))
    body = trimesh.creation.extrude_polygon(whole, 4.0, engine="earcut")
    write_stl(path, np.asarray(body.vertices), np.asarray(body.faces))


def halved(name: str, kept: float = 0.5) -> Callable[[Path], None]:
    def damage(package: Path) -> None:
        content = (package / name).read_bytes()
        (package / name).write_bytes(content[: int(kept * len(content))])

    return damage


def moved(name: str, x: float) -> Callable[[Path], None]:
    """The triangles of an STL file, farther to the right."""

    def damage(package: Path) -> None:
        body = read_stl(package / name)
        write_stl(package / name, np.add(body.vertices, [x, 0.0, 0.0]), body.triangles)

    return damage


def scaled(name: str, factor: float) -> Callable[[Path], None]:
    """The triangles of an STL file, larger or smaller."""

    def damage(package: Path) -> None:
        content = (package / name).read_bytes()
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
        facets = np.frombuffer(content[84:], dtype=record).copy()
        facets["corners"] *= np.float32(factor)
        (package / name).write_bytes(content[:84] + facets.tobytes())

    return damage


def with_dots_aside(package: Path) -> None:
    """A template all of whose holes are off by 1.66 mm, in every file."""
    for path in package.glob("laser/template_*.dxf"):
        document = readfile(path)
        for hole in document.modelspace().query('CIRCLE[layer=="CUT_INNER"]'):
            hole.dxf.center += (1.5, 0.7, 0.0)
        document.saveas(path)


DAMAGES: dict[str, tuple[Callable[[Path], None], str]] = {
    "inches": (edited(f"{UNITS}.dxf", "$INSUNITS\n 70\n4", "$INSUNITS\n 70\n1"), "$INSUNITS is 1"),
    "svg corner": (edited(f"{UNITS}.svg", '"A1" d="M', '"A1" d="M1'), "has another size or place"),
    "kerf missing": (gone(f"{KERF}*"), "there is no sheet of units for a kerf of 0.15 mm"),
    "unit missing": (gone("print/units/B1.stl"), "unit B1: it is missing"),
    "stl larger": (scaled("print/units/A1.stl", 1.01), "part A1: it is 8.181 mm high"),
    "3mf cut short": (halved("print/units_plate1.3mf"), "cannot be read back"),
    "bill": (edited("bom.csv", "unit,B2,1", "unit,B2,2"), "unit B2: it is there 2 times"),
    "another shim": (edited("bom.csv", "8.2500,8.1000", "8.2700,8.1000"), "it is not 8.27 x 8.10"),
    "clamp aside": (moved("fixture/CLAMP-A1.stl", 60.0), "unit A1: no part of the fixture holds"),
    "clamps that collide": (
        moved("fixture/CLAMP-A1.stl", 18.0),
        "part DRIVE-B1: it stands in the way of CLAMP-A1",
    ),
    "jig aside": (moved("fixture/JIG1.stl", 1.7), "it does not fit into its pocket of the jig"),
    "dots aside": (with_dots_aside, "dots 1.66 mm off the middle of the unit"),
    "clamp without a bolt": (
        without_bolt,
        "part CLAMP-A1: it has no hole of 4.2 mm for a bolt",
    ),
    "another letter": (
        edited(MANIFEST, '"letters_for_ids": {}', '"letters_for_ids": {"A1": "Q"}'),
        "unit A1: it is not on the assembly sheet",
    ),
    "pdf cut short": (halved("assembly.pdf"), "the assembly sheet"),
    "pins": (edited("bom.csv", "pin,PIN1.5,14", "pin,PIN1.5,13"), "13 pins for 14 holes"),
    "dots": (edited("bom.csv", "dot,dots,12", "dot,dots,11"), "11 dots for 12 holes"),
    "id swapped": (
        edited(f"{UNITS}.dxf", "1000\nA1\n", "1000\nZ9\n", -1),
        "unit A1: it is missing",
    ),
    "id twice": (edited(f"{UNITS}.dxf", "1000\nA1\n", "1000\nB1\n", -1), "unit A1: it is missing"),
    "layer": (edited(f"{UNITS}_r12.dxf", "CUT_OUTER", "CUT_OTHER", -1), "a layer of name"),
    "svg id": (edited(f"{UNITS}.svg", 'label="C2"', 'label="C9"'), "other parts, layers"),
    "svg scale": (edited(f"{UNITS}.svg", 'width="600mm"', 'width="600cm"'), "the page does not"),
    "r12 missing": (gone(f"{UNITS}_r12.dxf"), "units_sheet1_nominal_r12.dxf"),
    "no kerf made good": (copied(f"{UNITS}.dxf", f"{KERF}.dxf"), "another size or place"),
    "dxf cut short": (halved(f"{UNITS}.dxf"), "cannot be read back"),
    "another unit": (copied("print/units/A1.stl", "print/units/B1.stl"), "unit B1"),
    "one unit more": (copied("print/units/A1.stl", "print/units/D7.stl"), "unit D7"),
    "no id below": (without_id, "part A1: its underside shows no id"),
    "stl cut short": (halved("print/units/A1.stl"), "cannot be read back"),
    "assembled larger": (scaled("print/assembled.stl", 1.5), "unit C1 is not in its place"),
    "fixture broken": (halved("fixture/JIG1.stl"), "cannot be read back"),
    "shims": (edited("bom.csv", "shim,S8.25,", "spare,S8.25,"), "8 on the sheets, 0 in the bill"),
    "too few shims": (edited("bom.csv", "shim,S8.25,8,", "shim,S8.25,7,"), "8 on the sheets, 7 in"),
    "pdf without an end": (halved("assembly.pdf", 0.999), "it is not whole"),
}


def test_a_package_passes_as_it_is_written(whole: tuple[Path, Problem]) -> None:
    check(*whole)
    assert not whole[0].with_name("faults").exists()


def test_the_name_in_a_mesh_ends_with_a_zero(whole: tuple[Path, Problem]) -> None:
    """Mesh checkers in C read it, as a text, until there is one."""
    for path in whole[0].glob("print/units/*.stl"):
        assert path.read_bytes()[:80].rstrip(b"\0") == b"millimetres"
        assert path.read_bytes()[79] == 0


@pytest.mark.parametrize("name", some(DAMAGES, 13))
def test_a_damaged_package_fails(package: Path, whole: tuple[Path, Problem], name: str) -> None:
    damage, expected = DAMAGES[name]
    damage(package)
    assert expected in refused(package, whole[1])


@cases("fabrication", "given, expected")
def test_a_package_of_other_settings_is_refused(
    whole: tuple[Path, Problem], given: dict[str, object], expected: str
) -> None:
    asked = Fabrication.model_validate(given, context=SIM_UNITS)
    with pytest.raises(UserError) as raised:
        check(whole[0], whole[1].model_copy(update={"fabrication": asked}))
    assert expected in str(raised.value)


def test_a_bar_that_joins_units_of_different_drives_is_found(
    whole: tuple[Path, Problem], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, settings = whole[0], whole[1].fabrication
    parts = expected_parts(built.design(), "cloaked")
    shapes = unit_sections(read_stl(folder / "print/assembled.stl"), parts, settings)
    plate = shapely.union_all([*parts.polygons.values()]).convex_hull
    monkeypatch.setattr(print_folder, "_base", lambda *_: plate)
    for drives, told in (((("A1", "B1"),), False), ((("A1",), ("B1",)), True)):
        record = PackageRecord(folder, parts, shapes, settings, {}, drives)
        words = [fault.what for fault in print_folder.check_fixtures(record)]
        assert ("it joins units of different drives (A1 and B1)" in words) is told


def test_shims_of_other_lengths_are_found(package: Path, whole: tuple[Path, Problem]) -> None:
    edited("bom.csv", "8.2500,8.1000", "8.3000,8.1000")(package)
    parts, settings = expected_parts(built.design(), "cloaked"), whole[1].fabrication
    shapes = unit_sections(read_stl(package / "print/assembled.stl"), parts, settings)
    faults = check_bill(PackageRecord(package, parts, shapes, settings, {}))
    what = "its shim S8.25 does not fit 8.25 mm from slot end to slot end"
    assert [fault.what for fault in faults] == [what] * len(parts.joints)


@pytest.mark.parametrize("name", ["bom.csv", "laser/comb_sheet1_nominal.svg"])
def test_changed_files_are_found(package: Path, whole: tuple[Path, Problem], name: str) -> None:
    (package / name).write_bytes((package / name).read_bytes() + b"\n")
    with pytest.raises(UserError, match="is another file than listed"):
        check(package, whole[1])


def test_the_same_design_gives_the_same_bytes(whole: tuple[Path, Problem], tmp_path: Path) -> None:
    built.write(tmp_path / "cloaked")
    first, second = (
        {p.relative_to(f).as_posix(): file_hash(p) for p in f.rglob("*") if p.is_file()}
        for f in (whole[0], tmp_path / "cloaked")
    )
    assert first == second
    suffixes = {Path(name).suffix for name in first}
    assert suffixes == {".dxf", ".svg", ".stl", ".3mf", ".pdf", ".csv", ".json"}


def test_the_bill_says_which_files_hold_each_unit_and_shim(whole: tuple[Path, Problem]) -> None:
    rows = [row for row in read_bill(whole[0] / BILL) if row["item"] in ("unit", "shim")]
    files = [row["files"].split() for row in rows]
    assert all(files)
    assert all((whole[0] / name).is_file() for names in files for name in names)


def test_two_ligaments_of_one_pair_of_units_are_told_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second one joins the lower corners of A1 and B1."""
    pairs = [*handmade.neighbours(), ((0, 3), (1, 3))]
    monkeypatch.setattr(handmade, "neighbours", lambda: pairs)
    folder = tmp_path / "cloaked"
    asked = built.write(folder, {"shims": {"prebend_strain": 0.9}})
    check(folder, asked)
    told = json.loads((folder / MANIFEST).read_text())["prebend"]
    assert len(told) == len(pairs)
    both = [one["middle_mm"] for one in told.values() if one["units"] == "A1 - B1"]
    assert len(both) == 2
    rows = [row for row in read_bill(folder / BILL) if row["item"] == "ligament"]
    assert len({row["id"] for row in rows}) == len(rows)
    assert sum(row["note"].startswith("A1 - B1; shim S") for row in rows) == 2


DxfVersion: TypeAlias = Literal["R2010", "R12"]

OPTIONS: dict[str, dict[str, object]] = tables("fabrication")["options"]


@pytest.mark.parametrize("version", ["R2010", "R12"])
def test_a_drawing_says_how_far_it_extends(tmp_path: Path, version: DxfVersion) -> None:
    write_dxf(LaserSheet("empty", (600.0, 300.0), ()), tmp_path / "empty.dxf", version)
    header = readfile(tmp_path / "empty.dxf").header
    assert tuple(header["$EXTMIN"])[:2] == (0.0, 0.0)
    assert tuple(header["$EXTMAX"])[:2] == (600.0, 300.0)


def test_the_rim_of_a_sheet_is_on_a_layer_that_is_not_plotted(tmp_path: Path) -> None:
    write_dxf(LaserSheet("empty", (600.0, 300.0), ()), tmp_path / "empty.dxf")
    layers = readfile(tmp_path / "empty.dxf").layers
    plotted = {name: layers.get(name).dxf.plot for name in LAYER_COLOURS}
    assert plotted == {name: int(name != "REFERENCE") for name in LAYER_COLOURS}


def test_a_sheet_in_fractions_of_an_inch_is_as_large_as_asked_for(tmp_path: Path) -> None:
    given = {"laser": {"sheet": ["48.0625 in", "24 in"]}}
    laser = Fabrication.model_validate(given, context=SIM_UNITS).laser
    path = tmp_path / "empty.svg"
    write_svg(LaserSheet("empty", laser.sheet, ()), path)
    assert 'width="1220.7875mm" height="609.6mm"' in path.read_text(encoding="utf-8")
    assert list(check_scale(read_drawing(path), laser)) == []


@pytest.mark.parametrize("name", some(OPTIONS, 1))
def test_other_parameters_make_a_right_package(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "cloaked"
    asked = built.write(folder, OPTIONS[name]).fabrication
    check_package(folder, built.design(), "cloaked", asked, tmp_path / "faults")
