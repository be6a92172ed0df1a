from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from ezdxf.enums import InsertUnits
from ezdxf.filemanagement import new, readfile
from pydantic import TypeAdapter

from pipeline import datasets
from pipeline import problem as problems
from pipeline.__main__ import run_stage
from pipeline.posing import scene_of
from pipeline.problem.outlines.network_files import COLUMNS
from pipeline.problem.reading import load
from pipeline.problem.sections import selected_units
from sim.structure import Lattice, quads, void_angles
from tests.pipeline.static import HOLE, MIMIC, designed, write
from tests.tables import cases, refused

SQUARES = quads(5, 5, 15.0, 2.25, np.deg2rad(20.0))
QUADS = (
    "  kind: quads\n  columns: 5\n  rows: 5\n  spacing: 15 mm\n  ligament_length: 2.25 mm\n"
    "  bias_angle: 20 deg\n"
)
STIFF = "kind,number,x (mm),y (mm),shear (N/mm)\n"


def as_csv(path: Path, lattice: Lattice) -> None:
    rows = [",".join(COLUMNS)]
    corners = zip(lattice.unit, lattice.vertices.tolist(), strict=True)
    rows += [f"unit,{u},{x!r},{y!r}" for u, (x, y) in corners]
    for number, ends in enumerate(lattice.vertices[lattice.ligaments].tolist()):
        rows += [f"ligament,{number},{x!r},{y!r}" for x, y in ends]
    path.write_text("\n".join(rows))


def as_netcdf(path: Path, lattice: Lattice) -> None:
    corner = lattice.ligaments - lattice.first_vertex[lattice.ligament_units]
    xr.Dataset(
        {
            "vertices": (("unit", "vertex", "xy"), lattice.padded(lattice.vertices)),
            "ligament_unit": (("ligament", "end"), lattice.ligament_units),
            "ligament_vertex": (("ligament", "end"), corner),
        }
    ).to_netcdf(path)


def as_dxf(path: Path, lattice: Lattice) -> None:
    """Draws as by hand: in cm, some units clockwise, some closed by their last corner or twice.

    Ligaments do not quite meet them.
    """
    drawing = new(units=InsertUnits.Centimeters)
    space = drawing.modelspace()
    for unit in range(lattice.n_units):
        ring = lattice.vertices[lattice.unit == unit] / 10
        corners = ring[:: -1 if unit % 3 else 1].tolist()
        space.add_lwpolyline(corners + corners[:1] * (unit % 2), close=unit % 4 < 3)
    for start, end in (lattice.vertices[lattice.ligaments] / 10 + 0.01).tolist():
        space.add_line(start, end)
    drawing.saveas(path)


WRITERS = {"csv": as_csv, "nc": as_netcdf, "dxf": as_dxf}


def from_file(folder: Path, name: str) -> Path:
    """A problem whose lattice is the squares of `name`."""
    path = write(folder, HOLE, size=5, amplitude=3.0)
    text = path.read_text()
    assert QUADS in text
    path.write_text(text.replace(QUADS, f"  kind: file\n  file: {name}\n  spacing: 15 mm\n"))
    return path


def run(problem: Path) -> tuple[xr.Dataset, xr.Dataset]:
    chosen, moved = designed(problem), problem.with_name("r.nc")
    study = ["--problem", str(problem), "--quiet", "--out", str(moved)]
    assert run_stage("simulate", [*study, "--design", str(chosen)]) == 0
    return datasets.read(chosen, "design"), datasets.read(moved, "response")


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_listed_lattice_is_the_one_that_was_listed(tmp_path: Path, suffix: str) -> None:
    WRITERS[suffix](tmp_path / f"x.{suffix}", SQUARES)
    problem = load(from_file(tmp_path, f"x.{suffix}"))
    plain = load(write(tmp_path, HOLE, size=5))
    for ids in (problems.void_units, problems.cloak_units, problems.interest_units):
        assert ids(problem) == ids(plain)
    for side in ("left", "right", "top", "bottom", "corners", "centre"):
        wanted = selected_units(side, plain.lattice)
        assert selected_units(side, problem.lattice) == wanted
    found = problems.from_canonical(problems.canonical_json(problem)).lattice.network()
    np.testing.assert_allclose(np.sort(found.vertices, axis=0), np.sort(SQUARES.vertices, axis=0))
    np.testing.assert_array_equal(found.ligament_units, SQUARES.ligament_units)


@pytest.mark.slow
def test_a_drawing_runs_as_the_lattice_that_it_shows(tmp_path: Path) -> None:
    as_dxf(tmp_path / "hand.dxf", SQUARES)
    _, drawn = run(from_file(tmp_path, "hand.dxf"))
    altered, cloaked = drawn["loss"].values[1:, 0]
    assert altered == pytest.approx(0.1714, abs=1e-4)
    assert cloaked < 0.9 * altered


def test_outlines_with_arcs_are_told(tmp_path: Path) -> None:
    drawing = new(units=InsertUnits.Millimeters)
    corners = [(0.0, 0.0), (9.0, 0.0, 0.0, 0.0, 0.4), (9.0, 9.0), (0.0, 9.0)]
    drawing.modelspace().add_lwpolyline(corners, close=True)
    drawing.modelspace().add_line((0.0, 0.0), (1.0, 1.0))
    drawing.saveas(tmp_path / "x.dxf")
    with refused("the outline from (0, 0) mm on has arcs", "lattice.file", remedy="straight"):
        load(from_file(tmp_path, "x.dxf"))


def test_ligaments_of_a_drawing_may_be_polylines(tmp_path: Path) -> None:
    as_dxf(path := tmp_path / "x.dxf", SQUARES)
    listed = load(from_file(tmp_path, "x.dxf")).lattice
    drawing = readfile(path)
    space = drawing.modelspace()
    for k, line in enumerate(list(space.query("LINE"))):
        add = space.add_lwpolyline if k % 2 else space.add_polyline2d
        add([line.dxf.start.vec2, line.dxf.end.vec2])
        space.delete_entity(line)
    drawing.saveas(path)
    assert load(from_file(tmp_path, "x.dxf")).lattice == listed


@pytest.mark.parametrize("kind", ["add_lwpolyline", "add_polyline2d"])
def test_mirrored_outlines_are_read_where_they_are_seen(tmp_path: Path, kind: str) -> None:
    """CAD programs mirror by turning the axes of an outline over, with its points at -x."""
    as_dxf(path := tmp_path / "x.dxf", SQUARES)
    listed = load(from_file(tmp_path, "x.dxf")).lattice
    drawing = readfile(path)
    space = drawing.modelspace()
    for line in list(space.query("LWPOLYLINE")):
        corners = [(-x, y) for x, y in line.vertices()]
        add, turned = getattr(space, kind), {"extrusion": (0.0, 0.0, -1.0)}
        add(corners, close=line.is_closed, dxfattribs=turned)
        space.delete_entity(line)
    drawing.saveas(path)
    assert load(from_file(tmp_path, "x.dxf")).lattice == listed


DRAWN = {
    "circle": lambda space: space.add_circle((1.0, 2.0), 1.0),
    "spline": lambda space: space.add_spline([(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]),
    "solid": lambda space: space.add_solid([(0, 1), (2, 1), (0, 3), (2, 3)]),
}


@pytest.mark.parametrize("kind", DRAWN)
def test_what_is_neither_polyline_nor_line_is_told(tmp_path: Path, kind: str) -> None:
    as_dxf(path := tmp_path / "x.dxf", SQUARES)
    drawing = readfile(path)
    drawing.modelspace().add_text("units").set_placement((0.0, 0.0))
    drawing.modelspace().add_linear_dim((0.0, 2.0), (0.0, 0.0), (3.0, 0.0)).render()
    drawing.modelspace().add_hatch().paths.add_polyline_path([(0, 1), (2, 1), (1, 3)])
    drawing.saveas(path)
    load(from_file(tmp_path, "x.dxf"))
    DRAWN[kind](drawing.modelspace())
    drawing.saveas(path)
    with refused(f"the {kind} about (10, 20) mm is not read", "lattice.file", "or delete it"):
        load(from_file(tmp_path, "x.dxf"))


def test_what_a_drawing_would_lose_is_told(tmp_path: Path) -> None:
    as_dxf(path := tmp_path / "x.dxf", SQUARES)
    drawing = readfile(path)
    drawing.blocks.new("PIN").add_circle((0.0, 0.0), 1.0)
    drawing.modelspace().add_blockref("PIN", (1.0, 2.0))
    drawing.saveas(path)
    with refused("the block PIN at (10, 20) mm is not read", "lattice.file", "explode"):
        load(from_file(tmp_path, "x.dxf"))
    as_dxf(path, SQUARES)
    drawing = readfile(path)
    drawing.modelspace().add_lwpolyline([(1.0, 2.0), (3.0, 4.0), (5.0, 0.0)])
    drawing.saveas(path)
    with refused("the open line from (10, 20) mm on is neither", "lattice.file", "close it"):
        load(from_file(tmp_path, "x.dxf"))


KAGOME = """  kind: kagome
  columns: {size}
  rows: {size}
  spacing: 15 mm
  ligament_length: 2.25 mm
  bias: 1.5 mm
"""


def kagome(folder: Path, size: int, void: float, cloak: float) -> Path:
    """A problem of size x size cells; discs of these radii (mm) in the middle."""
    centre = f"centre: [{7.5 * size} mm, {7.5 * size} mm]"
    discs = {"void": void, "cloak": cloak}.items()
    hole = [f"{name}: {{ disc: {{ {centre}, radius: {r} mm }} }}\n" for name, r in discs]
    path = write(folder, "".join(hole) + MIMIC, size=5, amplitude=2.0)
    text = path.read_text().replace(QUADS, KAGOME.format(size=size))
    text = text.replace("block_angle: 30", "block_angle: 10")
    path.write_text(text.replace("edge_length: 3 mm", "edge_length: 1 mm"))
    return path


def test_a_kagome_lattice_from_problem_to_response(tmp_path: Path) -> None:
    shipped, moved = run(kagome(tmp_path, 5, 8, 28))
    assert shipped.sizes["vertex"] == 3
    assert shipped.sizes["unit"] == 50
    void = np.flatnonzero(shipped["region"] == 3)
    assert shipped["i"].values[void].tolist() == [4, 5]
    assert shipped["j"].values[void].tolist() == [2, 2]
    assert (shipped["i"].values[shipped["support"] == 2] >= 8).all()
    intact, altered, cloaked = moved["loss"].values[:, 0]
    assert intact == 0.0
    assert cloaked < 0.9 * altered
    assert (moved["overlaps"] == 0).all()


@pytest.mark.parametrize("kind", ["listed", "kagome"])
def test_no_void_of_a_lattice_is_in_contact_before_any_load(tmp_path: Path, kind: str) -> None:
    as_csv(tmp_path / "x.csv", SQUARES)
    path = from_file(tmp_path, "x.csv") if kind == "listed" else kagome(tmp_path, 5, 8, 28)
    net = load(path).lattice.network()
    least = float(np.degrees(np.asarray(void_angles(net, net.vertices)).min()))
    text = path.read_text()
    for cutoff in (least - 1.0, least + 1.0):
        path.write_text(text.replace("cutoff_angle: -10 deg", f"cutoff_angle: {cutoff:g} deg"))
        if cutoff < least:
            load(path)
    with refused(f"its void angles start at {least:g} deg", "contact.cutoff_angle", "below"):
        load(path)


def test_the_authors_kagome_lattice(tmp_path: Path) -> None:
    problem = load(kagome(tmp_path, 15, 35, 75))
    lattice = problem.lattice.network()
    assert (lattice.n_units, lattice.n_ligaments) == (450, 225 + 2 * 14 * 15)
    assert len(selected_units("left", problem.lattice)) == 30
    assert len(problems.void_units(problem)) + len(problems.cloak_units(problem)) == pytest.approx(
        157, abs=4
    )


def test_corners_that_are_words_are_told(tmp_path: Path) -> None:
    as_netcdf(tmp_path / "x.nc", SQUARES)
    data = xr.load_dataset(tmp_path / "x.nc")
    data["vertices"] = data["vertices"].astype(str).str.replace(".", ",")
    data.to_netcdf(tmp_path / "x.nc")
    with refused("not a readable lattice"):
        load(from_file(tmp_path, "x.nc"))


def test_a_damaged_dataset_is_told(tmp_path: Path) -> None:
    """HDF5 tells of a checksum that is wrong by another error than of a file that is none."""
    path = tmp_path / "x.nc"
    as_netcdf(path, SQUARES)
    data = xr.load_dataset(path)
    corners = data["vertices"]
    checked = {"fletcher32": True, "chunksizes": corners.shape}
    data.to_netcdf(path, encoding={"vertices": checked})
    whole, first = path.read_bytes(), corners.values[0].tobytes()
    assert first in whole
    path.write_bytes(whole.replace(first, first[::-1]))
    with refused("not a readable lattice"):
        load(from_file(tmp_path, "x.nc"))


@cases("problem", "name, content, what")
def test_a_bad_list_is_told(tmp_path: Path, name: str, content: str | None, what: str) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    with refused(what, "lattice.file") as caught:
        load(from_file(tmp_path, name))
    assert caught.value.value == name


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_lattice_of_too_many_bytes_is_not_read(suffix: str, tmp_path: Path) -> None:
    with (tmp_path / f"x.{suffix}").open("wb") as content:
        content.truncate((64 << 20) + 1)
    with refused("67108865 bytes, which is more than 67108864", "lattice.file"):
        load(from_file(tmp_path, f"x.{suffix}"))


@cases("problem", "rows, what")
def test_bad_ligaments_are_told(tmp_path: Path, rows: str, what: str) -> None:
    as_csv(tmp_path / "x.csv", SQUARES)
    with (tmp_path / "x.csv").open("a") as listed:
        listed.write(f"\n{rows}")
    with refused(what, remedy="" if "row" in what else "once"):
        load(from_file(tmp_path, "x.csv"))


def test_ligaments_of_a_list_may_have_stiffnesses_of_their_own(tmp_path: Path) -> None:
    """Told by either row, kept by those that stay when the void is cut, and by a round trip."""
    as_csv(tmp_path / "x.csv", SQUARES)
    header, *rows = (tmp_path / "x.csv").read_text().splitlines()
    filled = [f"{row},{i}" if row.startswith("lig") and i % 2 else f"{row}," for i, row in
              enumerate(rows)]  # fmt: skip
    told = "\n".join([f"{header},bending (N mm/rad)", *filled])
    (tmp_path / "x.csv").write_text(told)
    problem = load(from_file(tmp_path, "x.csv"))
    scene = scene_of(problems.from_canonical(problems.canonical_json(problem)), tmp_path)
    first = 1 + next(i for i, row in enumerate(rows) if row.startswith("lig")) // 2 * 2
    own = first + 2 * np.arange(SQUARES.n_ligaments, dtype=float)
    intact = scene.objective.reference
    assert intact is not None
    np.testing.assert_array_equal(intact.structure.material.bending_stiffness, own)
    np.testing.assert_array_equal(intact.structure.material.shear_stiffness, 1.19)
    ends = intact.lattice.id[intact.lattice.ligament_units]
    kept = np.isin(ends, scene.lattice.id).all(axis=1)
    assert 0 < kept.sum() < len(own)
    np.testing.assert_array_equal(scene.structure.material.bending_stiffness, own[kept])
    named = {"measured_constants": {"file": "constants.csv"}}
    report = problems.sections.ReportOptions.model_validate(named)
    with refused("the lattice's file tells the stiffnesses", "report.measured_constants"):
        problems.over_measured_constants(problem.model_copy(update={"report": report}), tmp_path)


def test_a_list_has_no_unit_cell_for_a_spectrum(tmp_path: Path) -> None:
    as_csv(tmp_path / "x.csv", SQUARES)
    path = from_file(tmp_path, "x.csv")
    band = "spectrum: { transmission: { from: 1 Hz, to: 9 Hz } }\n"
    path.write_text(path.read_text() + band)
    with refused("has no unit cell to send waves through", "spectrum"):
        load(path)


def test_hexagonal_is_another_name_of_the_honeycomb() -> None:
    sizes = {"columns": 3, "rows": 4, "spacing": "15 mm", "ligament_length": "2.25 mm"}
    reader: TypeAdapter[object] = TypeAdapter(problems.sections.Lattice)
    one, other = (
        reader.validate_python({"kind": kind, **sizes}) for kind in ("honeycomb", "hexagonal")
    )
    assert one == other


@pytest.mark.parametrize(
    ("lattice", "first"),
    [
        ({"kind": "quads", "bias_angle": "20 deg"}, (0.0, 0.0)),
        ({"kind": "triangular"}, (0.0, 0.0)),
        ({"kind": "honeycomb"}, (0.0, 7.5)),
        ({"kind": "kagome", "bias": "0 mm"}, None),
    ],
    ids=["squares", "hexagons", "honeycomb", "kagome"],
)
def test_the_origin_is_as_told(lattice: dict[str, str], first: tuple[float, float] | None) -> None:
    """Compares with the site of unit (0, 0), or joints of cells with the corner of the first."""
    more = {"columns": 4, "rows": 4, "spacing": "15 mm", "ligament_length": "2 mm"}
    reader: TypeAdapter[problems.sections.Lattice] = TypeAdapter(problems.sections.Lattice)
    made = reader.validate_python({**more, **lattice}).network()
    if first is not None:
        assert made.site[0] == pytest.approx(first)
        return
    assert made.vertices.min(axis=0) == pytest.approx([np.sqrt(0.75), 1.0])
