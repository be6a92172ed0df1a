import base64
import io
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from pipeline import problem
from reports.__main__ import main
from reports.products.fabrication import fabrication_report, pictures
from reports.products.fabrication.renderer import Body, picture
from tests.pipeline.fabrication import built
from tests.reports.conftest import Failing
from tests.tables import cases

COLOUR = "#8d62c0"
FIG4 = Path(__file__).parents[3] / "experiments" / "fig4" / "problem.yaml"


def cube(size: float = 10.0) -> Body:
    mesh = trimesh.creation.box((size, size, size))
    return Body(np.asarray(mesh.vertices), np.asarray(mesh.faces), COLOUR)


def test_a_cube_seen_from_the_top_is_a_square() -> None:
    image = picture([cube()], 224, elevation=90.0)
    ink = image.min(axis=2) < 250
    rows, columns = np.unique(np.nonzero(ink)[0]), np.unique(np.nonzero(ink)[1])
    assert len(rows) == len(columns) == 200
    assert ink[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].all()


def test_nearer_bodies_hide_farther_ones_and_far_faces_are_not_drawn() -> None:
    low = Body(cube().vertices, cube().triangles, "#ff0000")
    high = Body(cube().vertices * 0.5 + [0.0, 0.0, 20.0], cube().triangles, "#0000ff")
    for bodies in ([low, high], [high, low]):
        image = picture(bodies, 224, elevation=90.0)
        red, _, blue = image[image.shape[0] // 2, image.shape[1] // 2]
        assert (red, blue > 100) == (0, True)
    turned = Body(cube().vertices, cube().triangles[:, ::-1], COLOUR)
    assert not np.array_equal(picture([turned], 224), picture([cube()], 224))


@pytest.fixture(scope="module", autouse=True)
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "WIDTH", 300)
        yield


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fabrication") / "cloaked"
    built.write(folder)
    return folder


def page_of(out: Path, *packages: Path) -> str:
    words = ["--problem", built.PROBLEM, "--packages", *packages, "--out", out, "--quiet"]
    assert main(["fabrication", *map(str, words)]) == 0
    return out.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(package: Path) -> str:
    return page_of(package.with_name("index.html"), package)


def test_the_page_shows_every_sheet_and_plate_and_tells_the_bill(package: Path, page: str) -> None:
    shown = re.findall(r'<figcaption><a href="([^"]+)">', page)
    drawings = [*package.glob("laser/*_nominal.dxf"), *package.glob("*/*.3mf")]
    wanted = {path.relative_to(package.parent).as_posix() for path in drawings}
    assert set(shown) == wanted | {"cloaked/print/assembled.stl"}
    for link in re.findall(r'href="(cloaked/[^"]+)"', page):
        assert (package.parent / link).is_file()
    found = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
    assert len(found) >= 6
    for text in found:
        with Image.open(io.BytesIO(base64.b64decode(text))) as image:
            assert (np.asarray(image.convert("L")) < 230).sum() > 100
    for words in (
        "<strong>6</strong>units",
        "A1 to C2",
        "shims with spares",
        "laser.kerf",
        "free length of shims",
    ):
        assert words in page


def test_the_legend_has_the_colours_of_the_files(package: Path, page: str) -> None:
    drawn = "".join(path.read_text() for path in package.glob("laser/*_nominal.svg"))
    shown = re.findall(r'<i style="color: (#\w+)"></i>(\w+)</span>', page)
    assert len(shown) == 5
    for colour, layer in shown:
        (found,) = set(re.findall(rf'<g id="{layer}"[^>]* stroke="(#\w+)"', drawn))
        assert found == colour


def test_the_same_package_gives_the_same_page(package: Path, page: str, tmp_path: Path) -> None:
    assert page_of(tmp_path / "again.html", package) == page


@cases("reports", "before, after, told")
def test_a_package_of_another_version_makes_one_message(
    tmp_path: Path, package: Path, failing: Failing, before: str, after: str, told: str
) -> None:
    folder = shutil.copytree(package, tmp_path / "cloaked")
    path = folder / "manifest.json"
    path.write_text(path.read_text(encoding="utf-8").replace(before, after, 1), encoding="utf-8")
    words = ["--problem", built.PROBLEM, "--packages", folder]
    said = failing("fabrication", tmp_path / "index.html", *words)
    assert told in said
    assert "make the package again" in said


def test_the_page_maps_the_shims_that_are_bent(tmp_path: Path) -> None:
    built.write(tmp_path / "cloaked", {"slots": {"direction": "centroid"}})
    page = page_of(tmp_path / "index.html", tmp_path / "cloaked")
    assert "Shims before any load" in page
    assert "3.0 %" in page
    assert "0 of 7 beyond 5 %" in page


@pytest.mark.slow
def test_the_page_puts_losses_as_built_beside_those_as_designed(tmp_path: Path) -> None:
    for name, designed, built_loss in (("altered", 0.92, 0.9), ("cloaked", 0.0347, 0.111)):
        built.write(tmp_path / name)
        path = tmp_path / name / "manifest.json"
        told = json.loads(path.read_text())
        turns = {"turn_mean_deg": 0.39, "turn_max_deg": 4.59}
        losses = {"loss_as_designed": designed, "loss_as_built": built_loss}
        path.write_text(json.dumps(told | {"as_built": turns | losses}))
    page = page_of(tmp_path / "index.html", tmp_path / "altered", tmp_path / "cloaked")
    for cell in ("0.39° on average, 4.59° at most", "0.0347", "0.111", "3.8 %", "12.3 %"):
        assert f"<td>{cell}</td>" in page


def test_losses_that_are_energies_have_their_unit() -> None:
    turns = {"turn_mean_deg": 0.4, "turn_max_deg": 4.6}
    told = {"cloaked": {"as_built": turns | {"loss_as_designed": 0.0347, "loss_as_built": 0.111}}}
    asked = problem.load(FIG4)
    rows = list(fabrication_report.as_built(asked, told))
    assert ("Cloaked structure: loss J", "0.0347 N mm", "0.111 N mm") in rows


@pytest.mark.parametrize(
    ("laser", "value", "note", "cut"),
    [
        ({"kerf": "0.15 mm"}, "cut 6 times", "slots of 0.45 mm are cut 3 times", "15 / 1"),
        ({"kerf": "0 mm"}, "cut 6 times", "slots of 0.45 mm are cut 3 times", "15 / 1"),
        ({"aspect_ratio": 1.0}, "print only", "which would take 18 layers", None),
        ({"aspect_ratio": 20.0}, "cut", "cut from sheet of 8.1 mm", "5 / 1"),
    ],
)
def test_the_page_tells_whether_units_can_be_cut(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    laser: dict[str, object],
    value: str,
    note: str,
    cut: str | None,
) -> None:
    monkeypatch.setattr(fabrication_report, "_groups", lambda *_: ())  # of pictures
    asked = built.write(tmp_path / "cloaked", {"laser": laser})
    told = {
        each.label: each
        for each in fabrication_report.package(tmp_path / "cloaked", asked)["facts"]
    }
    fact = told["units by laser"]
    assert fact.value == value
    assert note in fact.note
    counts = told["sheets to cut / plates to print"]
    assert counts.value == "3 / 3"  # of units and coupon, the plates alone
    assert counts.note.partition("cut by laser ")[2] == (cut or "")
