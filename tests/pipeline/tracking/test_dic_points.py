"""A commercial DIC system's points become a track."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.tracking.frames import import_video
from pipeline.tracking.geometry import outlines_of_design
from pipeline.tracking.output.dic_points import DicPoints, track
from tests.pipeline.conftest import Failing
from tests.pipeline.virtual_lab.conftest import GRID
from tests.tables import cases, refused

SMALL = GRID | {"grid": [4, 4]}
ORIGIN, ROTATION = np.array([100.0, 40.0]), np.deg2rad(30.0)
NOISE = 0.002
REACH = 3.0
LEAST = 3
AXES = "origin: [100 mm, 40 mm]\nrotation: 30 deg\nflipped: true\n"


@pytest.fixture
def export(tmp_path: Path) -> tuple[Path, np.ndarray]:
    """A YAML beside its CSV, y downwards and turned; and the motion (2, 16, 3) of the units."""
    design = import_video.design(SMALL)
    datasets.write(design, tmp_path / "design.nc", "design", {"problem": "{}"})
    specimen = outlines_of_design(design)
    random = np.random.default_rng(4)
    motion = np.zeros((2, 16, 3))
    motion[1] = random.uniform(-2, 2, (16, 3)) * [1, 1, 0.4]
    turn = np.array([[np.cos(ROTATION), -np.sin(ROTATION)], [np.sin(ROTATION), np.cos(ROTATION)]])
    lines = ["Exported by a DIC system", "", "t;X [mm];Y [mm];dX [mm];dY [mm]"]
    for step in range(2):
        for unit in range(16):
            arm = random.uniform(-3, 3, (30, 2))
            cos, sin = np.cos(motion[step, unit, 2]), np.sin(motion[step, unit, 2])
            gone = arm @ np.array([[cos, sin], [-sin, cos]]) + motion[step, unit, :2] - arm
            gone += NOISE * random.normal(size=gone.shape)
            gone[0] += 1.0  # a point that went astray
            place = (specimen.centre[unit] + arm) @ turn.T * [1, -1] + ORIGIN
            table = np.column_stack([np.full(30, 5.0 + step), place, gone @ turn.T * [1, -1]])
            lines += [";".join(f"{value:.6f}" for value in row) for row in table]
    lines.append("6.0;100.0;;0.1;0.1")
    (tmp_path / "dic.csv").write_text("\n".join(lines), encoding="utf-8")
    names = "{time: t, x: 'X [mm]', y: 'Y [mm]', ux: 'dX [mm]', uy: 'dY [mm]'}"
    text = f"points: dic.csv\ndesign: design.nc\ncolumns: {names}\n{AXES}"
    (tmp_path / "points.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "points.yaml", motion


def test_points_become_the_motions_of_their_units(export: tuple[Path, np.ndarray]) -> None:
    path, motion = export
    out = path.with_name("track.nc")
    assert run_stage("track", ["points", str(path), "--out", str(out)]) == 0
    made = datasets.read(out, "track")
    np.testing.assert_allclose(made["time"], [0.0, 1.0])
    error = made["displacement"].values - motion
    assert np.abs(error[..., :2]).max() < 4 * NOISE
    assert 0.6 < np.std(error / made["sigma"].values) < 1.4
    assert (made["quality"] == 0).all()
    assert made.attrs["synthetic"] == "no"
    assert out.with_suffix(".csv").exists()


@cases("tracking", "old, new, told")
def test_points_that_do_not_fit_are_refused(
    export: tuple[Path, np.ndarray], failing: Failing, old: str, new: str, told: str
) -> None:
    path, _ = export
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    words = ["points", str(path), "--out", str(path.with_name("track.nc"))]
    assert told in failing("track", words)


@pytest.mark.parametrize("count", [1, 2])
def test_points_too_few_to_tell_a_motion_are_refused(count: int) -> None:
    design, seen = overlapping(1)
    unit = np.arange(len(seen.time)) // 81
    few = np.arange(len(unit)) % 81 < np.where(unit % 16 < 15, count, 81)
    with refused(f"1 of 16 units bear points enough, {LEAST} or more", "origin", f"{LEAST} or"):
        track(design, DicPoints(*(values[few] for values in seen)))


def overlapping(overlap: int, rotation: float = 0.0) -> tuple[xr.Dataset, DicPoints]:
    """Points of still units, each the mean of as many patches of white noise either way.

    The grid is turned against the units by `-rotation`.
    """
    design = import_video.design(SMALL)
    specimen = outlines_of_design(design)
    random, side, frames = np.random.default_rng(3), 9, 30
    cos, sin = np.cos(rotation), np.sin(rotation)
    grid = np.stack(np.meshgrid(*[np.linspace(-REACH, REACH, side)] * 2), axis=-1).reshape(-1, 2)
    grid = grid @ np.array([[cos, -sin], [sin, cos]])
    place = (specimen.centre[:, None] + grid).reshape(-1, 2)
    white = random.normal(size=(frames, 16, side + overlap - 1, side + overlap - 1, 2))
    patches = np.lib.stride_tricks.sliding_window_view(white, (overlap, overlap), axis=(2, 3))
    noise = NOISE * overlap * patches.mean(axis=(-2, -1)).reshape(frames, -1, 2)
    times = np.repeat(np.arange(float(frames)), len(place))
    return design, DicPoints(times, np.tile(place, (frames, 1)), noise.reshape(-1, 2))


def ratio(made: xr.Dataset) -> np.ndarray:
    """Errors over their sigma, root mean square, of units that do not move."""
    return np.sqrt(np.mean((made["displacement"].values / made["sigma"].values) ** 2, axis=(0, 1)))


@pytest.mark.parametrize("overlap", [1, 3, 7])
def test_sigma_holds_where_subsets_overlap(overlap: int) -> None:
    design, seen = overlapping(overlap)
    np.testing.assert_allclose(ratio(track(design, seen)), 1.0, atol=0.2)


@pytest.mark.parametrize("overlap", [5, 12])
def test_sigma_holds_for_subsets_of_known_size(overlap: int) -> None:
    design, seen = overlapping(overlap)
    made = track(design, seen, subset=overlap * 2 * REACH / 8)
    np.testing.assert_allclose(ratio(made), 1.0, atol=0.2)


def test_sigma_holds_where_the_specimen_is_turned_in_the_picture() -> None:
    design, seen = overlapping(5, ROTATION)
    np.testing.assert_allclose(ratio(track(design, seen)), 1.0, atol=0.2)
