"""Programs that a lab opens the files with: slicer, mesh checker, CAD, Inkscape, PDF viewer."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.fabrication.papers import read_bill
from pipeline.fabrication.readback import read_3mf, read_drawing, read_stl
from tests.clients.conftest import program
from tests.pipeline.fabrication import built

KINDS = {"units", "shims", "template", "comb", "coupon"}
DPI = 300
MM = 25.4 / DPI
FOOT = 20.0  # mm of a page that hold the check bar
BED = "0x0,250x0,250x210,0x210"
SOLID = ("--fill-density", "100%", "--fill-pattern", "rectilinear", "--skirts", "0")
PER_MM = 96 / 25.4  # what Inkscape counts in


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fabrication") / "cloaked"
    built.write(folder)
    return folder


def told(*command: str | Path, seconds: float = 60.0) -> str:
    """What a program says, which has to end well."""
    done = subprocess.run(
        [program(str(command[0])), *map(str, command[1:])],
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def filament(gcode: Path) -> float:
    """Volume of the filament that a G-code takes, mm^3."""
    words = re.search(r"; filament used \[mm\] = ([\d.]+)", gcode.read_text())
    assert words
    return float(words[1]) * np.pi / 4 * 1.75**2


@pytest.mark.parametrize("name", ["print/units/A1.stl", "print/assembled.stl", "fixture/JIG1.stl"])
def test_the_slicer_finds_meshes_manifold(package: Path, name: str) -> None:
    info = told("prusa-slicer", "--info", package / name)
    solid = read_stl(package / name)
    assert "manifold = yes" in info
    size = [float(found) for found in re.findall(r"size_[xyz] = ([\d.]+)", info)]
    np.testing.assert_allclose(size, solid.extent[1] - solid.extent[0], atol=1e-3)


def test_the_mesh_checker_finds_no_open_edge(package: Path) -> None:
    for path in [*package.glob("print/units/*.stl"), *package.glob("fixture/*.stl")]:
        said = told("admesh", path)
        assert re.search(r"Total disconnected facets\s*:\s*0\s+0\n", said), said
        assert re.search(r"Number of parts\s*:\s*1\s", said), said
        for fault in ("Edges fixed", "Facets reversed", "Backwards edges"):
            assert re.search(rf"{fault}\s*:\s*0\n", said), said


def test_a_unit_is_sliced_to_its_volume(package: Path, tmp_path: Path) -> None:
    path, gcode = package / "print/units/B1.stl", tmp_path / "unit.gcode"
    told("prusa-slicer", "-g", path, *SOLID, "--bed-shape", BED, "-o", gcode)
    assert filament(gcode) == pytest.approx(read_stl(path).mesh.volume, rel=0.05)


@pytest.mark.parametrize(
    "name", ["print/units_plate1.3mf", "print/coupon_plate1.3mf", "fixture/fixture_plate1.3mf"]
)
def test_a_plate_is_sliced_to_its_volume(package: Path, tmp_path: Path, name: str) -> None:
    gcode = tmp_path / "plate.gcode"
    place = ("--merge", "--dont-arrange", "--bed-shape", BED)
    told("prusa-slicer", "-g", package / name, *place, *SOLID, "-o", gcode)
    volume = sum(solid.mesh.volume for solid in read_3mf(package / name))
    assert filament(gcode) == pytest.approx(volume, rel=0.05)


@pytest.mark.parametrize("infill", [0.15, 0.65])
def test_print_time_and_filament_are_those_of_the_slicer(tmp_path: Path, infill: float) -> None:
    """Of every plate of a package, within 15 %."""
    built.write(tmp_path / "cloaked", {"print": {"infill": infill}})
    gcode = tmp_path / "plate.gcode"
    bill = {row["id"]: row["note"] for row in read_bill(tmp_path / "cloaked/bom.csv")}
    plates = [name for name in bill if name.endswith(".3mf")]
    assert len(plates) == 3
    for name in plates:
        place = ("--merge", "--dont-arrange", "--bed-shape", BED, "--skirts", "0")
        density = ("--fill-density", f"{100 * infill:g}%")
        told("prusa-slicer", "-g", tmp_path / "cloaked" / name, *place, *density, "-o", gcode)
        words = re.search(r"about (\d+) h (\d+) min, ([\d.]+) m", bill[name])
        assert words
        minutes = 60 * int(words[1]) + int(words[2])
        assert minutes == pytest.approx(print_minutes(gcode), rel=0.15)
        volume = 1000 * float(words[3]) * np.pi / 4 * 1.75**2
        assert volume == pytest.approx(filament(gcode), rel=0.15)


def print_minutes(gcode: Path) -> float:
    """Time that the slicer tells of its G-code."""
    words = re.search(
        r"printing time \(normal mode\) = (?:(\d+)h )?(\d+)m (\d+)s", gcode.read_text()
    )
    assert words
    hours, minutes, seconds = (int(word or 0) for word in words.groups())
    return 60 * hours + minutes + seconds / 60


def test_cad_prints_every_drawing_with_ink(package: Path, tmp_path: Path) -> None:
    """Every kind of drawing, and one of them in all its variants."""
    drawn = {*package.glob("laser/*_nominal.dxf"), *package.glob("laser/units_*.dxf")}
    assert {path.name.partition("_")[0] for path in drawn} == KINDS
    for path in sorted(drawn):
        copy = tmp_path / path.name
        copy.write_bytes(path.read_bytes())
        told("librecad", "dxf2pdf", "-a", copy, seconds=20.0)
        inked = pixels(copy.with_suffix(".pdf"), tmp_path, dpi=60)
        assert (inked < 200).sum() > 200, path


@pytest.mark.parametrize("kind", ["nominal", "kerf0.15"])
def test_the_vector_editor_measures_true_size(package: Path, kind: str) -> None:
    path = package / f"laser/units_sheet1_{kind}.svg"
    drawing = read_drawing(path)
    boxes = [row.split(",") for row in told("inkscape", path, "--query-all").splitlines()]
    assert drawing.size is not None
    sizes = {name: np.array([float(x) for x in rest]) / PER_MM for name, *rest in boxes if name}
    hair = 0.0762  # drawn on both sides of the cut
    outlines = [c.points for c in drawing.curves if c.layer == "CUT_OUTER"]
    wanted = np.concatenate(outlines)
    width, height = wanted.max(axis=0) - wanted.min(axis=0)
    found = sizes["CUT_OUTER"]
    assert found[2] - hair == pytest.approx(width, abs=0.1)
    assert found[3] - hair == pytest.approx(height, abs=0.1)
    np.testing.assert_allclose(sizes["REFERENCE"][2:] - hair, drawing.size, atol=0.01)


def pixels(pdf: Path, folder: Path, dpi: int) -> np.ndarray:
    """The first page in grey."""
    made = folder / f"{pdf.stem}.pgm"
    stem = str(made).removesuffix(".pgm")
    told("pdftoppm", "-r", str(dpi), "-f", "1", "-l", "1", "-singlefile", "-gray", pdf, stem)
    with Image.open(made) as image:
        return np.asarray(image)


def test_the_check_bar_is_as_long_as_it_says(package: Path, tmp_path: Path) -> None:
    page = pixels(package / "assembly.pdf", tmp_path, DPI)
    assert page.shape == pytest.approx((297.0 / MM, 210.0 / MM), abs=1.5)
    dark = page[-round(FOOT / MM) :] < 100
    lengths = [longest_run(row) * MM for row in dark]
    assert max(lengths) == pytest.approx(100.0, abs=0.2)
    assert sum(length > 99.0 for length in lengths) * MM == pytest.approx(2.0, abs=0.2)


def longest_run(row: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
    return int(max(edges[1::2] - edges[::2], default=0))


def test_the_viewer_reads_every_id(package: Path) -> None:
    words = told("pdftotext", "-layout", package / "assembly.pdf", "-").split()
    assert {"A1", "B1", "C1", "A2", "B2", "C2"} <= set(words)
