from collections.abc import Callable
from pathlib import Path
from string import Template

import numpy as np
import pytest
import shapely
import xarray as xr
from matplotlib.patches import Patch
from PIL import Image, ImageDraw

from pipeline.posing import altered_lattice_of, cost_line, doubts, scene_of
from pipeline.problem import load
from pipeline.problem.sections import Method, Robust
from pipeline.runtime import ROOT
from reports.__main__ import main
from reports.products import check
from sim.scene import estimate_cost, sample_times
from sim.structure import polygons
from tests.pipeline import static

IMAGE = (
    "void: { image: { file: logo.png, width: 60 mm }, loose: remove }\n"
    "cloak: { disc: { radius: 100 mm } }\n"
)


def doubted(path: Path) -> list[str]:
    return list(doubts(asked := load(path), scene_of(asked, path.parent)))


def test_a_picture_and_a_line_of_cost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=3.0)
    assert main(["check", "--problem", str(path), "--out-dir", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().err
    assert "24 units, 8 of them to redesign; 42 unknowns; 1 load case(s)" in told
    assert "4 evaluations of the design" in told
    assert "warning" not in told
    with Image.open(tmp_path / "out/check.png") as picture:
        assert min(picture.size) > 500


@pytest.mark.parametrize(("own", "drawn"), [([], True), (["--preset", "far"], False)])
def test_faults_of_variants_are_told_one_by_one(
    own: list[str], drawn: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the picture of the problem, if it has none itself."""
    presets = "presets: { far: { drive: { amplitude: 900 mm } }, typo: { horizon: { stepz: 2 } } }"
    path = static.write(tmp_path, static.HOLE + presets, size=5, amplitude=3.0)
    words = ["check", "--problem", str(path), *own, "--variants", "far", "typo"]
    assert main([*words, "--out-dir", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert told.count("error: ") == 2
    assert told.count(f"file:   {path}") == 2
    assert "moves its units by 900 mm" in told
    assert "@typo: unknown key" in told
    assert (tmp_path / "out/check.png").exists() == drawn


def test_a_measured_motion_ends_where_the_study_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes on the other way afterwards, and further."""
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=3.0)
    text = path.read_text()
    series = (
        "drive: { kind: time_series, units: right, file: push.csv }\nhorizon: { duration: 0.4 s }"
    )
    begin, end = text.index("drive:"), text.index("\nconstraints:")
    path.write_text(text[:begin] + series + text[end:])
    lines = "time (s),ux (mm),uy (mm),theta (rad)\n0,0,0,0\n0.5,-1,0,0\n1,9,0,0\n"
    (tmp_path / "push.csv").write_text(lines)
    shown: list[xr.Dataset] = []
    monkeypatch.setattr(check, "rest_panel", lambda *given: shown.append(given[2]))
    assert main(["check", "--problem", str(path), "--out-dir", str(tmp_path / "out")]) == 0
    moved = shown[0]["displacement"].isel(structure=0, case=0, unit=0).sel(dof="ux")
    np.testing.assert_allclose(moved, [0.0, -0.8])


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            "report: { places: [[30 mm, 60 mm]] }\n",
            "`report.places` are shown where a motion in time",
        ),
        (
            "designs: { void.disc.radius: [7 mm, 8 mm] }\n",
            "the page of several `designs` is of harmonic drives, not of `linear_ramp`",
        ),
    ],
)
def test_what_no_figure_shows_is_doubted(
    given: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = static.write(tmp_path, static.HOLE + given, size=5, amplitude=3.0)
    assert main(["check", "--problem", str(path), "--out-dir", str(tmp_path / "out")]) == 0
    assert f"warning: {told}" in capsys.readouterr().err


def test_measured_constants_are_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    named = "report: { measured_constants: { file: constants.csv, samples: 2 } }\n"
    path = static.write(tmp_path, static.HOLE + named, size=5, amplitude=3.0)
    (tmp_path / "constants.csv").write_text("axial_stiffness (N/mm)\n120\n119\n")
    assert main(["check", "--problem", str(path), "--out-dir", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert "columns are missing" in told
    assert "constants.csv" in told
    assert "key:    report.measured_constants.file" in told


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("response:", "report: { snapshots: [2 mm, 4 mm] }\nresponse:", "ends at 3 mm, which is"),
        ("response:", "report: { snapshots: [2 mm, 3 mm] }\nresponse:", None),
        ("linear_ramp", "tanh_ramp", None),
    ],
)
def test_pictures_beyond_the_load_are_doubted(
    old: str, new: str, told: str | None, tmp_path: Path
) -> None:
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=3.0)
    text = path.read_text().replace(old, new)
    path.write_text(text.replace(", steps: 4", "") if "tanh" in new else text)
    found = doubted(path)
    assert len(found) == (told is not None)
    assert told is None or told in found[0]


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("solver", "accuracy", "tight"),
        ("solver", "integrator", "explicit"),
        ("response", "cycles", 2.0),
        ("report", "instants", (0.5,)),
        ("objective", "snap_margin", 0.2),
        ("optimiser", "angle", Method(evaluations=3)),
    ],
)
def test_keys_that_nothing_takes_up_are_doubted(
    section: str, key: str, value: object, tmp_path: Path
) -> None:
    asked = load(static.write(tmp_path, static.HOLE, size=5, amplitude=3.0))
    changed = getattr(asked, section).model_copy(update={key: value})
    idle = asked.model_copy(update={section: changed})
    (told,) = doubts(idle, scene_of(asked, tmp_path))
    assert told.startswith(f"`{section}.{key}` does nothing")


def test_loads_slower_than_the_drive_are_doubted(tmp_path: Path) -> None:
    """By two periods of 2 Hz they are judged over one second."""
    asked = load(ROOT / "experiments/fig2/problem.yaml")
    loads = [{"frequency": f"{each} Hz"} for each in (0.5, 2, 8)]
    robust = Robust.model_validate({"loads": [*loads, {"amplitude": "2 mm"}]})
    objective = asked.objective.model_copy(update={"robust": robust})
    slower = asked.model_copy(update={"objective": objective})
    (told,) = doubts(slower, scene_of(asked, tmp_path))
    assert told.startswith("`objective.robust.loads[0].frequency`: the loss counts 0.5 periods")
    assert "and not 2" in told


def test_descents_and_imperfect_copies_take_time(tmp_path: Path) -> None:
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=3.0)
    more = "law: geometric", "optimiser: { angle: { evaluations: 3 }, descents: 2,"
    text = path.read_text().replace("law: angle", more[0]).replace("optimiser: {", more[1])
    path.write_text(text)
    assert "14 evaluations of the design" in cost_line(load(path), scene_of(load(path), tmp_path))
    asked = load(static.write(tmp_path, static.HEART, size=30))
    objective = asked.objective.model_copy(update={"robust": Robust(copies=64)})
    robust, scene = asked.model_copy(update={"objective": objective}), scene_of(asked, tmp_path)
    assert cost_line(asked, scene) != cost_line(robust, scene)


def test_the_cost_grows_as_the_factor_does(tmp_path: Path) -> None:
    costs = []
    for size in (15, 30):
        path = static.write(tmp_path, static.SHIELD if size == 15 else static.HEART, size=size)
        scene = scene_of(load(path), tmp_path)
        costs.append(estimate_cost(scene, sample_times(scene)))
    assert costs[1].unknowns > 3.5 * costs[0].unknowns
    assert costs[1].seconds > 3.5 * costs[0].seconds
    assert "min on one core" not in cost_line(load(path), scene)


def test_units_too_soft_to_be_rigid_are_doubted(tmp_path: Path) -> None:
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=3.0)
    assert doubted(path) == []
    path.write_text(path.read_text() + "\nreport: { unit_modulus: 20 MPa }\n")
    (told,) = doubted(path)
    assert "soft against their ligaments, though they count as rigid: 24" in told


def drawn(folder: Path, draw: Callable[[ImageDraw.ImageDraw], object]) -> Path:
    picture = Image.new("L", (200, 200), 255)
    draw(ImageDraw.Draw(picture))
    picture.save(folder / "logo.png")
    return static.write(folder, IMAGE + static.MIMIC)


def test_inverted_pictures_and_far_pushes_are_doubted(tmp_path: Path) -> None:
    def ring(on: ImageDraw.ImageDraw) -> None:
        on.rectangle((5, 5, 195, 195), fill=0)
        on.ellipse((60, 60, 140, 140), fill=255)

    (told,) = doubted(drawn(tmp_path, ring))
    assert "logo.png shows 2 outlines" in told
    disc = drawn(tmp_path, lambda on: on.ellipse((60, 60, 140, 140), fill=0))
    assert doubted(disc) == []
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=40.0)
    (told,) = doubted(path)
    assert told.startswith("the drive goes 40 mm, 5")


@pytest.mark.parametrize(("angle", "amplitude"), [("180", "1"), ("180", "0.05"), ("0", "1")])
def test_a_push_on_rows_of_hexagons_is_doubted(tmp_path: Path, angle: str, amplitude: str) -> None:
    """They buckle at 0.19 mm: 8 x 8 of them."""
    text = (ROOT / "pipeline/workflow/templates/static.yaml").read_text()
    disc = "  disc: { centre: centre, radius: 18 mm }"
    text = Template(text).substitute(name="x", build="", title="x", void=disc, quick=f"    {disc}")
    text = text.replace("kind: quads", "kind: triangular").replace("  bias_angle:", "  #")
    text = text.replace("[180 deg]", f"[{angle} deg]").replace(
        "amplitude: 4 mm", f"amplitude: {amplitude} mm"
    )
    (tmp_path / "problem.yaml").write_text(text)
    asked = load(tmp_path / "problem.yaml", "quick")
    told = list(doubts(asked, scene_of(asked, tmp_path)))
    assert len(told) == ((angle, amplitude) == ("180", "1"))
    assert all(line.startswith("rows of hexagons buckle") for line in told)


SQUEEZED = """
drives:
  - { kind: linear_ramp, units: left, amplitude: 1 mm, direction: 0 deg, duration: 1 s }
  - { kind: linear_ramp, units: right, amplitude: 1 mm, direction: 180 deg, duration: 1 s }
horizon: { duration: 1 s, steps: 4 }
"""
PUSHED = """
drive: { kind: force, units: right, amplitude: 1 N, direction: 180 deg, frequency: 1 Hz, FREE }
horizon: { duration: 1 s, samples: 21 }
"""


def without_supports(folder: Path, loads: str) -> Path:
    path = static.write(folder, static.HOLE, size=5, amplitude=1.0)
    text = path.read_text()
    begin, end = text.index("supports:"), text.index("\nconstraints:")
    longer = text[end:].replace("response: { samples: 9 }", "response: { samples: 24 }")
    path.write_text(text[:begin] + loads + longer)
    return path


@pytest.mark.parametrize(
    ("loads", "floats"),
    [
        (SQUEEZED, False),
        (PUSHED.replace("FREE", "free: [uy]"), True),
        (PUSHED.replace("FREE", "free: [uy, theta]"), True),
    ],
)
def test_what_nothing_holds_is_doubted(loads: str, floats: bool, tmp_path: Path) -> None:
    """Two driven sides hold all between them; a force holds nothing."""
    found = doubted(without_supports(tmp_path, loads))
    assert any(told.startswith("nothing holds the structure") for told in found) == floats
    assert floats or found == []


@pytest.mark.parametrize("clamped", [True, False])
def test_the_legend_names_clamped_units_where_there_are_some(
    clamped: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=1.0)
    path = path if clamped else without_supports(tmp_path, SQUEEZED)
    names: list[str] = []

    def kept(color: str, label: str) -> Patch:
        names.append(label)
        return Patch(color=color, label=label)

    monkeypatch.setattr(check, "Patch", kept)
    assert main(["check", "--problem", str(path), "--out-dir", str(tmp_path / "out")]) == 0
    assert ("clamped" in names) == clamped
    assert "driven" in names


def test_a_neck_is_doubted(tmp_path: Path) -> None:
    """Two voids' worth of units leave a column joined by one unit."""
    wide = "void: { polygon: { vertices: [[22 mm, -8 mm], [38 mm, -8 mm], [38 mm, 50 mm],"
    wide += " [22 mm, 50 mm]] } }\ncloak: { disc: { radius: 29 mm } }\n"
    (told,) = doubted(static.write(tmp_path, wide + static.MIMIC, size=5, amplitude=3.0))
    assert told.startswith("necks of one unit: 1, the first at [2, 4]")


@pytest.mark.parametrize(
    ("drive", "more", "told"),
    [
        ("harmonic", "fabrication: { thickness: 4 mm }", ["4.96", "thickness: 4.98 mm"]),
        ("harmonic", "fabrication: { material: PETG, thickness: 4.9 mm }", None),
        ("harmonic", "fabrication: { print: { infill: 0.8 } }", ["8.04", "give 0.62 there"]),
        ("harmonic", "", None),
        ("linear_ramp", "fabrication: { thickness: 4 mm }", None),
    ],
)
def test_a_mass_that_no_specimen_has_is_doubted(
    drive: str, more: str, told: list[str] | None, tmp_path: Path
) -> None:
    """In motions in time alone: 6.18 kg/m^2 are 0.62 of 8.1 mm of PLA, of 1240 kg/m^3."""
    path = static.write(tmp_path, static.HOLE + more, size=5, amplitude=3.0)
    if drive == "harmonic":
        text = path.read_text().replace("linear_ramp", "harmonic").replace(", steps: 4", "")
        text = text.replace("samples: 9", "samples: 99")
        path.write_text(text.replace("  duration: 1 s", "  frequency: 1 Hz"))
    found = [line for line in doubted(path) if "the units weigh" in line]
    assert len(found) == (told is not None)
    if told:
        per_area, remedy = told
        asked = load(path)
        area = float(
            shapely.area(polygons(lattice := altered_lattice_of(asked), lattice.vertices)).sum()
        )
        assert f"weigh {6.18e-3 * area:.3g} g" in found[0]
        assert f"{float(per_area) * 1e-3 * area:.3g} g" in found[0]
        assert remedy in found[0]
