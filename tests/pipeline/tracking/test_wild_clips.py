"""Clips as labs film them: nothing is wrong and called good, and sigma holds."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.tracking.clip_scripts import SCRIPTS
from benchmarks.tracking.rendering import Renderer, View, eight_bit, pose_bound
from benchmarks.tracking.wild_clips import (
    WildClip,
    errors,
    film_clip,
    make_clip,
    specimen,
    track_clip,
)
from pipeline.runtime import UserError
from pipeline.tracking.detect import detect_lattice
from pipeline.tracking.detect.lattice_votes import locate_lattice
from pipeline.tracking.fit import frame_fit
from pipeline.tracking.motion import Track, track_video
from pipeline.tracking.reference_frame import RecordingSetup
from sim.core import Floats, Mask, Singles
from tests.tables import cases, some, tables


def shown(name: str, folder: Path, frames: int) -> tuple[WildClip, Track]:
    clip = make_clip(name, folder, frames)
    return clip, track_clip(clip)


HEAVY = some(map(tuple, tables("tracking")["heavy_clips"]), 0)


@cases("tracking", "name, frames, rms, lost", *HEAVY)
def test_no_unit_is_wrong(name: str, frames: int, rms: float, lost: float, tmp_path: Path) -> None:
    """Or called good where it is."""
    clip, track = shown(name, tmp_path, frames)
    found = errors(clip, track)
    assert found.gross == 0
    assert found.rms < rms
    assert found.lost <= lost
    assert ((track.quality == 0) == np.isfinite(track.displacement[..., 0])).all()


def test_threads_change_no_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clip, tracks = make_clip("plain", tmp_path, 2), []
    for threads in (1, 3):
        monkeypatch.setattr(frame_fit, "_THREADS", threads)
        tracks.append(track_clip(clip))
    assert np.array_equal(tracks[0].displacement, tracks[1].displacement)
    assert np.array_equal(tracks[0].sigma, tracks[1].sigma)


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        pytest.param("stick_slip", 24, marks=pytest.mark.slow),
        ("rolling_shutter", 14),
        pytest.param("motion_blur_untold", 14, marks=pytest.mark.slow),
        pytest.param("hand", 12, marks=pytest.mark.slow),
        pytest.param("mains_flicker", 24, marks=pytest.mark.slow),
        pytest.param("returns_h264", 48, marks=pytest.mark.slow),
    ],
)
def test_sigma_holds(name: str, frames: int, tmp_path: Path) -> None:
    clip, track = shown(name, tmp_path, frames)
    assert (track.timing == 0).all()
    assert errors(clip, track).sigma_ratio.min() > 0.7
    assert errors(clip, track).sigma_ratio.max() < 1.4


def test_a_specimen_is_found_without_a_scale_however_small_it_is() -> None:
    squares, still = specimen(), np.zeros((1, 81, 3))
    view = View(size=(720, 720), scale=1.6)
    image = eight_bit(Renderer(squares, lambda _: still, view).frame(0.0))
    assert len(detect_lattice(image, squares, None)[0].unit) == 81


def test_the_blur_of_a_camera_is_measured(tmp_path: Path) -> None:
    _, track = shown("soft_focus", tmp_path, 2)
    assert track.calibration.blur / track.calibration.pixel == pytest.approx(1.1, rel=0.2)


@pytest.mark.parametrize("seed", [3, 13])
def test_a_column_alone_in_view_is_found_unturned(seed: int) -> None:
    """Though it matches each of the lattice's columns, and turned ones as well."""
    squares = specimen()
    uneven = np.random.default_rng(seed).normal(0.0, 0.3, squares.centre.shape)
    seen = squares.centre + np.array([84.0, -1.0]) + uneven
    column = seen[squares.centre[:, 0] < squares.centre[:, 0].min() + 1.0]

    def inside(place: Floats) -> Mask:
        return np.asarray(place[..., 0] < column[:, 0].max() + 5.0)

    found = locate_lattice(squares.centre, squares.joint, column, 1.0, inside)
    right = [one for one in found if one.score == 9 and abs(one.turn) < 0.1]
    assert any(np.abs(one.place - seen).max() < 4.0 for one in right)


def test_a_slope_of_the_light_does_not_move_outlines(tmp_path: Path) -> None:
    """Else dark units seem off their places, and swing about these when they turn."""

    def shade(image: Singles, time: float) -> None:
        row = np.arange(len(image), dtype=np.float32)[:, None]
        image *= 1 + np.float32(0.15) * np.sin(row / 50 + np.float32(time))

    script = SCRIPTS["plain"]._replace(cover=shade, times=np.zeros(1))
    clip = film_clip(script, tmp_path / "unused.mkv")
    assert np.abs(track_clip(clip).calibration.residual).mean() < 0.01


def test_the_bound_of_squares_is_that_of_their_edges() -> None:
    """Of edges that are blurred by b: a length l tells l cos^2 C^2 / 2 sqrt(pi) b of the place."""
    squares, still = specimen(), np.zeros((1, 81, 3))
    view = View(distance=1e6, tilt=0.0, noise=(2.0, 0.0))
    found = pose_bound(squares, lambda _: still, view, 0.0, None)
    side = 4.0 * (15.0 - 2.3) / np.cos(np.deg2rad(20.0)) / np.sqrt(2.0)  # px
    contrast, noise, blur = 175.0, 4.0 + 1 / 12, np.sqrt(0.7**2 + 1 / 12)
    along = contrast**2 / (2 * np.sqrt(np.pi) * blur * noise)
    place = 1 / np.sqrt(along * 2 * side) / 4.0  # mm: of four edges, cos^2 and sin^2
    turn = 1 / np.sqrt(along * 4 * side**3 / 12)  # each edge's lever along itself
    np.testing.assert_allclose(found[:, :2], place, rtol=0.03)
    np.testing.assert_allclose(found[:, 2], turn, rtol=0.12)  # the blur takes of the corners


def test_a_picture_shown_again_is_told(tmp_path: Path) -> None:
    clip, track = shown("shown_again", tmp_path, 30)
    np.testing.assert_array_equal(track.timing == 1, clip.fault)


def test_a_camera_that_moves_is_told_of(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    clip = make_clip("tripod_knocked", tmp_path, 14)
    fixed = RecordingSetup(held=clip.held)
    with caplog.at_level("WARNING"):
        track_video(iter(clip.frames), clip.specimen, clip.scale, setup=fixed)
    assert "all clamped units move together" in caplog.text
    blind = RecordingSetup(held=clip.held & False, follows_supports=True)
    with pytest.raises(UserError, match="clamped units") as caught:
        track_video(iter(clip.frames[:2]), clip.specimen, clip.scale, setup=blind)
    assert caught.value.remedy
