"""Every way in which a mesh can be wrong is made in a file, and found there."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from shapely import Polygon

from pipeline.fabrication.checks.print_folder import check_plate
from pipeline.fabrication.checks.slot_checks import UnitSection, check_section
from pipeline.fabrication.parts import Unit, unit_solid
from pipeline.fabrication.readback import check_solid, check_volume, read_3mf, read_stl
from pipeline.fabrication.units import build_specimen, network
from pipeline.problem.fields import SIM_UNITS
from pipeline.problem.sections import Fabrication, Print
from pipeline.runtime import UserError
from sim.core import Floats, Ints
from tests.pipeline.fabrication import built, handmade
from tests.pipeline.fabrication.files import write_3mf, write_stl
from tests.pipeline.fabrication.handmade import ASKED
from tests.tables import cases

Mesh = tuple[Floats, Ints]
PRINT = Print()


def prism(outline: Polygon, height: float = 8.1) -> Mesh:
    body = trimesh.creation.extrude_polygon(outline, height, engine="earcut")
    return np.asarray(body.vertices), np.asarray(body.faces)


def unit() -> Unit:
    return handmade.specimen().units[1]


def changed_point(mesh: Mesh) -> Mesh:
    points = mesh[0].copy()
    points[3, 1] = np.nan
    return points, mesh[1]


def two_bodies(mesh: Mesh) -> Mesh:
    points, faces = mesh
    beside = np.add(points, [40.0, 0.0, 0.0])
    return np.vstack([points, beside]), np.vstack([faces, faces + len(points)])


def without_a_face(mesh: Mesh) -> Mesh:
    return mesh[0], mesh[1][:-1]


DAMAGES: dict[str, tuple[Callable[[Mesh], Mesh], str]] = {
    "a hole": (without_a_face, "its surface has holes"),
    "winding": (
        lambda mesh: (mesh[0], np.vstack([mesh[1][:1, ::-1], mesh[1][1:]])),
        "its triangles are not wound all the same way",
    ),
    "inside out": (lambda mesh: (mesh[0], mesh[1][:, ::-1]), "it is inside out"),
    "face twice": (
        lambda mesh: (mesh[0], np.vstack([mesh[1], mesh[1][:1]])),
        "its surface has holes",
    ),
    "not a number": (changed_point, "vertices that are no numbers"),
    "raised": (lambda mesh: (mesh[0] + [0.0, 0.0, 0.3], mesh[1]), "it starts at z = 0.300 mm"),
    "two bodies": (two_bodies, "it falls into 2 pieces"),
}


def told(mesh: Mesh, path: Path) -> list[str]:
    return [fault.what for fault in check_solid(read_stl(write_stl(path, *mesh)))]


def test_a_right_mesh_outline_and_plate_pass(tmp_path: Path) -> None:
    assert told(prism(unit().outline), tmp_path / "B1.stl") == []
    assert faults_of(unit().outline) == []
    assert plate_faults(write_3mf(tmp_path / "plate.3mf", *plate())) == []


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_mesh_is_caught(tmp_path: Path, name: str) -> None:
    damage, expected = DAMAGES[name]
    (found,) = told(damage(prism(unit().outline)), tmp_path / "B1.stl")
    assert expected in found


@pytest.mark.parametrize("content", [b"", b"solid nothing\nendsolid\n", None])
def test_what_is_no_mesh_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = write_stl(tmp_path / "B1.stl", *prism(unit().outline))
    path.write_bytes(path.read_bytes()[:999] if content is None else content)
    with pytest.raises(UserError, match="cannot be read back"):
        read_stl(path)


def test_volume_is_area_times_height(tmp_path: Path) -> None:
    solid = read_stl(write_stl(tmp_path / "B1.stl", *prism(unit().outline)))
    assert list(check_volume(solid, [0.0, 4.0, 8.1])) == []
    assert solid.mesh.volume == pytest.approx(unit().outline.area * 8.1, rel=1e-5)
    (fault,) = check_volume(solid, [0.0, 8.0])
    assert "area times height" in fault.what


def cut_through(made: Polygon) -> Polygon:
    x, y = made.centroid.coords[0]
    ring = Polygon([(x - 1, y - 1), (x + 1, y - 1), (x + 1, y + 1), (x - 1, y + 1)])
    return Polygon(made.exterior, [ring.exterior.coords])


def deeper(depth: float) -> Polygon:
    return handmade.specimen(depth).units[1].outline


def filled(made: Polygon) -> Polygon:
    """One slot less."""
    _, slot, *_ = handmade.specimen().units[1].slots
    return Polygon(made.union(handmade.box_along(slot.mouth, slot.end + slot.direction, 1.0)))


def wider(made: Polygon) -> Polygon:
    slot = handmade.specimen().units[1].slots[0]
    return Polygon(made.difference(handmade.box_along(slot.mouth, slot.end, 0.6)))


def thin_tips(made: Polygon) -> Polygon:
    """A sliver beside a mouth, as thin as a hair."""
    slot = handmade.specimen().units[1].slots[0]
    side = np.array([-slot.direction[1], slot.direction[0]]) * (slot.width / 2 + 0.02)
    start = slot.mouth + side
    tip = handmade.box_along(start, start + 0.7 * slot.direction, 0.04)
    return Polygon(made.union(tip))


def grown(made: Polygon) -> Polygon:
    x, y = made.centroid.coords[0]
    return Polygon(made.union(handmade.box_along(np.array([x, y]), np.array([x + 9, y + 4]), 2.0)))


def bitten(made: Polygon) -> Polygon:
    corners = np.asarray(unit().design.exterior.coords)
    middle = (corners[0] + corners[1]) / 2
    inwards = np.array(unit().design.centroid.coords[0]) - middle
    return Polygon(made.difference(handmade.box_along(middle - inwards, middle + inwards / 9, 1.5)))


OUTLINES: dict[str, tuple[Callable[[Polygon], Polygon], str]] = {
    "cut through": (cut_through, "a slot cuts through it"),
    "thin wall": (lambda _: deeper(6.3), "leaves a wall of 0."),
    "too deep": (lambda _: deeper(5.5), "is 5.50 mm deep, not 1 to 5 mm"),
    "slots meet": (lambda _: deeper(6.3), "mm apart, less than 0.8 mm"),
    "slot missing": (filled, "slots at the vertices 1, 2, ligaments at 0, 1, 2"),
    "slot too wide": (wider, "mm wide instead of 0.450 mm"),
    "sharp tips": (thin_tips, "leaves tips of 0.0"),
    "grown": (grown, "it reaches beyond the design"),
    "bitten": (bitten, "missing away from its corners"),
}


def faults_of(made: Polygon) -> list[str]:
    one = unit()
    ligaments = sorted(slot.vertex for slot in one.slots)
    shape = UnitSection(one.label, Path("B1.stl"), one.design, made, ligaments)
    return [f"{fault.part}: {fault.what}" for fault in check_section(shape, ASKED)]


@pytest.mark.parametrize("name", OUTLINES)
def test_a_damaged_outline_is_caught(name: str) -> None:
    damage, expected = OUTLINES[name]
    found = faults_of(damage(unit().outline))
    assert any(words.startswith("unit B1: ") and expected in words for words in found), found


def plate() -> tuple[dict[str, Mesh], dict[str, tuple[float, float]]]:
    units = handmade.specimen().units[:3]
    bodies = {one.label: prism(one.outline) for one in units}
    return bodies, {"A1": (20.0, 20.0), "B1": (22.0, 20.0), "C1": (24.0, 20.0)}


def plate_faults(path: Path) -> list[str]:
    return [f"{fault.part}: {fault.what}" for fault in check_plate(read_3mf(path), PRINT)]


@cases("fabrication", "x, y, expected")
def test_a_misplaced_part_fails(tmp_path: Path, x: float, y: float, expected: str) -> None:
    bodies, places = plate()
    found = plate_faults(write_3mf(tmp_path / "plate.3mf", bodies, places | {"B1": (x, y)}))
    assert any(words.startswith(expected) for words in found), found


def test_a_broken_plate_is_caught_and_what_is_no_plate_refused(tmp_path: Path) -> None:
    bodies, places = plate()
    bodies["C1"] = without_a_face(bodies["C1"])
    found = plate_faults(write_3mf(tmp_path / "plate.3mf", bodies, places))
    assert found == ["part C1: its surface has holes"]
    path = write_3mf(tmp_path / "plate.3mf", {"": prism(unit().outline)}, {"": (30.0, 30.0)})
    assert plate_faults(path) == ["part : an object without a name"]
    path = write_3mf(tmp_path / "plate.3mf", *plate(), unit="inch")
    with pytest.raises(UserError, match="not millimeter"):
        read_3mf(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(UserError, match="cannot be read back"):
        read_3mf(path)


@pytest.mark.parametrize("inset", ["0 mm", "0.25 mm", "0.4 mm"])
def test_letters_that_reach_the_rim_leave_a_solid(tmp_path: Path, inset: str) -> None:
    """Letters far too large, cut by a first layer that is drawn in."""
    given = {"print": {"first_layer_inset": inset}}
    asked = Fabrication.model_validate(given, context=SIM_UNITS)
    net = network(built.design(), "cloaked")
    for made in build_specimen(net, asked, ("toy", "cloaked"), tmp_path).units:
        middle = np.array(made.outline.centroid.coords[0])
        large = tuple(middle + 2.5 * (stroke - middle) for stroke in made.underside)
        mesh = unit_solid(replace(made, underside=large), asked).mesh
        write_stl(tmp_path / "unit.stl", mesh.vertices, mesh.faces)
        assert list(check_solid(read_stl(tmp_path / "unit.stl"))) == []
