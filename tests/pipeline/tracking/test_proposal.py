"""The first look at a video, by the stage `track init`."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from benchmarks.tracking.rendering import Renderer, View, eight_bit
from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.tracking.detect import detect_lattice, orientation_text, specimen_orientation
from pipeline.tracking.frames import import_video, read_frames, recording
from pipeline.tracking.geometry import outlines_of_design
from pipeline.tracking.reference_frame import (
    RecordingSetup,
    calibrate_camera,
    proposal,
    recognise,
)
from tests.pipeline.conftest import Failing
from tests.pipeline.tracking.conftest import CLIPS
from tests.pipeline.virtual_lab.conftest import GRID, film_of

SCALE = 1 / 0.365


def first(name: str) -> np.ndarray:
    return next(read_frames(import_video.video_of(CLIPS / f"{name}.yaml"))).image


@pytest.mark.parametrize("kind", ["dots", "speckle"])
def test_units_and_what_is_on_them_are_found(kind: str) -> None:
    image = next(film_of(kind).images())
    found = proposal.propose(image, import_video.design(GRID))
    assert found.kind == kind
    assert len(found.detection.unit) == found.specimen.count
    assert found.pixel_size == pytest.approx(0.365, rel=0.02)
    assert any("case" in warning for warning in found.warnings)


def test_a_mirrored_video_is_seen_as_such() -> None:
    image = next(film_of("bare").images())[:, ::-1]
    found = proposal.propose(np.ascontiguousarray(image), import_video.design(GRID))
    assert "mirrored" in orientation_text(found.detection.camera)


def test_units_outside_the_first_frame_are_told() -> None:
    image = np.ascontiguousarray(next(film_of("bare").images())[:, :250])
    warnings = proposal.propose(image, import_video.design(GRID), SCALE).warnings
    assert any("units lie outside the first frame" in warning for warning in warnings)


@pytest.fixture
def words(tmp_path: Path) -> list[str]:
    """Options that name a folder and the design in it."""
    design = tmp_path / "design.nc"
    origin = {"problem": "{}", "problem_hash": "", "parents": "{}"}
    datasets.write(import_video.design(GRID), design, "design", origin)
    return ["--out-dir", str(tmp_path), "--design", str(design)]


def covered_at_first(folder: Path) -> Path:
    """Writes a film whose first two pictures show a cap before the lens."""
    folder.mkdir()
    image = next(film_of("bare").images())
    for number, shown in enumerate((np.zeros_like(image), np.zeros_like(image), image)):
        assert cv2.imwrite(str(folder / f"{number}.png"), shown)
    return folder


def test_a_video_is_looked_at_where_the_specimen_is_seen(
    tmp_path: Path, words: list[str], failing: Failing
) -> None:
    told = ["init", str(covered_at_first(tmp_path / "film")), *words]
    assert "--start" in failing("track", told)
    assert "--frame-rate 300" in failing("track", [*told, "--start", "0.02"])
    assert "start earlier" in failing("track", [*told, "--start", "9", "--frame-rate", "100"])
    assert "since the file's first frame" in failing("track", [*told, "--start", "-1"])
    assert "frames per second" in failing("track", [*told, "--frame-rate", "0"])
    assert run_stage("track", [*told, "--start", "0.02", "--frame-rate", "100"]) == 0
    made = recording.load_recording(tmp_path / "film.yaml")
    assert (made.window.start, made.frame_rate) == (0.02, 100.0)
    assert "# frame_rate" not in (tmp_path / "film.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("option", ["--pixel-size", "--frame-rate"])
@pytest.mark.parametrize("value", ["0", "-0.3", "nan", "inf"])
def test_options_above_zero_are_refused_otherwise(
    option: str, value: str, words: list[str], failing: Failing
) -> None:
    told = failing("track", ["init", "film.mp4", *words, f"{option}={value}"])
    for part in (option, f"value:  {float(value)}", "no finite number above zero", "per"):
        assert part in told


def test_of_pictures_a_proposal_asks_for_the_rate(tmp_path: Path, words: list[str]) -> None:
    folder = covered_at_first(tmp_path / "film")
    for name in ("0.png", "1.png"):
        (folder / name).unlink()
    assert run_stage("track", ["init", str(folder), *words]) == 0
    assert "# frame_rate: how many" in (tmp_path / "film.yaml").read_text(encoding="utf-8")


def test_a_proposal_says_that_it_is_mirrored(tmp_path: Path, words: list[str]) -> None:
    for name, step in (("plain", 1), ("behind", -1)):
        (tmp_path / name).mkdir()
        image = np.ascontiguousarray(next(film_of("bare").images())[:, ::step])
        assert cv2.imwrite(str(tmp_path / name / "a1.png"), image)
        assert run_stage("track", ["init", str(tmp_path / name), *words]) == 0
        made = yaml.safe_load((tmp_path / f"{name}.yaml").read_text(encoding="utf-8"))
        assert made.get("mirrored") == {"plain": None, "behind": True}[name]


def part_of_the_film(left: int, right: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns of the first frame, and where each unit's middle lies in them, px."""
    whole = next(film_of("bare").images())
    specimen = outlines_of_design(import_video.design(GRID))
    seen = calibrate_camera(
        whole, specimen, recognise(whole, specimen, SCALE, RecordingSetup())[0], RecordingSetup()
    ).camera.project(specimen.centre)
    return np.ascontiguousarray(whole[:, left:right]), seen - [left, 0]


@pytest.mark.parametrize("columns", [(0, 264), (0, 250), (65, 320), (64, 264)])
def test_of_places_along_the_lattice_the_rim_tells(columns: tuple[int, int]) -> None:
    """Bias and polarity of a part of the lattice fit, a unit aside, one that is mirrored."""
    image, wanted = part_of_the_film(*columns)
    found = proposal.propose(image, import_video.design(GRID))
    assert orientation_text(found.detection.camera) == "upright"
    seen = found.detection.camera.project(found.specimen.centre)
    inside = ((wanted > 20) & (wanted < [image.shape[1] - 21, 299])).all(axis=1)
    np.testing.assert_allclose(seen[inside], wanted[inside], atol=2.0)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_part_of_a_lattice_is_seen_as_the_recording_says(mirrored: bool) -> None:
    image, _ = part_of_the_film(0, 264)
    specimen = outlines_of_design(import_video.design(GRID))
    ways = recognise(image, specimen, SCALE, RecordingSetup(mirrored=mirrored))
    assert {specimen_orientation(way.camera)[1] for way in ways} == {mirrored}


@pytest.mark.parametrize(("aside", "tilt"), [(15.0, 0.0), (10.0, 0.02)])
def test_squares_cut_by_the_rim_are_seen_all_ways(aside: float, tilt: float) -> None:
    """Their outlines fit all alike: which by a hair is noise; upright is taken, if none is told."""
    squares = outlines_of_design(import_video.design(GRID | {"grid": [7, 6]}))
    view = View(size=(272, 318), scale=3.03, tilt=tilt)
    moved = np.tile([aside, 0.0, 0.0], (1, squares.count, 1))
    image = eight_bit(Renderer(squares, lambda _: moved, view).frame(0.0))
    ways = recognise(image, squares, 3.03, RecordingSetup())
    assert len(ways) == 8
    assert orientation_text(ways[0].camera) == "upright"
    told = recognise(image, squares, 3.03, RecordingSetup(turned=0.0, mirrored=False))
    assert [orientation_text(way.camera) for way in told] == ["upright"]


def test_a_long_specimen_is_found_upright_in_an_upright_picture() -> None:
    """It is larger there than any at which it would fit as it is drawn."""
    specimen = outlines_of_design(import_video.design(GRID | {"grid": [16, 5]}))
    middle, scale = specimen.centre.mean(axis=0), 2.4
    image = np.full((640, 360), 230, np.uint8)
    for unit, centre in enumerate(specimen.centre):
        x, y = (specimen.polygon(unit) + centre - middle).T
        corners = np.stack([180 - scale * y, 320 - scale * x], axis=1)
        cv2.fillPoly(image, [np.round(16 * corners).astype(np.int32)], (40,), cv2.LINE_AA, 4)
    (found, *_) = detect_lattice(image, specimen, None)
    assert len(found.unit) == specimen.count
    assert "90 deg" in orientation_text(found.camera)


@pytest.mark.slow
def test_a_proposal_leaves_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(tmp_path)
    words = ["import", str(CLIPS / "f_silhouette.yaml"), "--out-dir", folder]
    assert run_stage("track", words) == 0
    words = ["init", str(CLIPS / "f_silhouette.mp4"), "--out-dir", folder]
    words += ["--design", str(tmp_path / "f_silhouette_design.nc")]
    assert run_stage("track", words) == 0
    told = capsys.readouterr().err
    assert "not told: case" in told
    assert "225 of 225 units, bare, 0.365" in told
    made = recording.load_recording(tmp_path / "f_silhouette.yaml")
    assert (tmp_path / str(made.video)).resolve() == (CLIPS / "f_silhouette.mp4").resolve()
    datasets.read(tmp_path / str(made.design), "design")
    drawn = cv2.imread(str(tmp_path / "f_silhouette_units.png"))
    assert drawn is not None
    assert drawn.shape == (1536, 1536, 3)
    assert run_stage("track", words) == 2
    assert "there is a recording already" in capsys.readouterr().err


@pytest.mark.slow
def test_a_turned_video_is_seen_as_such() -> None:
    """The top row is left out of the picture, so that up and down can be told apart."""
    design = import_video.design(import_video.description(CLIPS / "f_silhouette.yaml"))
    image = first("f_silhouette")
    found = proposal.propose(image, design, 2.74)
    height = found.specimen.centre[:, 1]
    row = np.flatnonzero(height > height.max() - 1)
    seen = found.detection.camera.project(found.specimen.centre[row])
    below = np.ascontiguousarray(image[int(seen[:, 1].max()) + 22 :])
    gone = np.isin(design["unit"].values, found.specimen.ids[row])
    names = ("vertices", "vertices_initial")
    cut = design.assign({name: design[name].where(~gone[:, None, None]) for name in names})
    turned = proposal.propose(np.ascontiguousarray(np.rot90(below)), cut, 2.74).detection
    assert len(turned.unit) == 210
    assert "90 deg" in orientation_text(turned.camera)
