"""Pixels from unit to unit: with many, quick units are found as with fewer; too few are told."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.tracking.clip_scripts import GRID, ClipScript
from benchmarks.tracking.rendering import Renderer, View, eight_bit
from benchmarks.tracking.wild_clips import errors, film_clip, specimen, track_clip
from pipeline.tracking.frames import Frame
from pipeline.tracking.geometry import Camera
from pipeline.tracking.motion import track_video
from pipeline.tracking.motion.unit_appearance import HIDDEN, STRAYED
from sim.core import Floats, Singles
from tests.tables import refused, some

CLIP = ClipScript(
    pace=lambda time: 2 * np.sin(2 * np.pi * 2 * time) ** 2,
    times=np.arange(6) / 30,
    grid=GRID | {"grid": [5, 5]},
)
"""Units turn by up to 9 deg from one frame to the next, and go up to a fifth of a pitch."""


def view(pitch: float, exposure: float = 0.0) -> View:
    """Shows the clip with so many pixels from unit to unit."""
    side = int(7 * pitch)
    return View(size=(side, side), scale=pitch / 15, exposure=exposure)


@pytest.mark.parametrize("pitch", some([60, 120], 1))
def test_quick_motions_are_followed_however_fine_pictures_are(pitch: int, tmp_path: Path) -> None:
    clip = film_clip(CLIP._replace(view=view(pitch)), tmp_path / "unused.mkv")
    found = errors(clip, track_clip(clip))
    assert (found.lost, found.gross) == (0.0, 0)
    assert found.rms < 0.01


def test_a_unit_in_view_that_went_too_far_is_not_hidden(tmp_path: Path) -> None:
    def covered(image: Singles, time: float) -> None:
        """Puts a unit aside in one frame, and a cap over another."""
        if time > 0.05:
            unit = image[60:119, 60:119].copy()
            image[60:119, 60:119] = 205.0
            image[43:102, 43:102] = unit
            cv2.circle(image, (270, 270), 42, 120.0, -1)

    script = CLIP._replace(view=view(60), cover=covered, times=np.arange(3) / 30)
    script = script._replace(pace=lambda time: 0 * time)
    clip = film_clip(script, tmp_path / "unused.mkv")
    place = np.round(script.view.project(clip.specimen.centre - clip.specimen.centre.mean(axis=0)))
    aside, under = (
        int(np.argmin(np.linalg.norm(place - at, axis=1))) for at in ((89, 89), (270, 270))
    )
    track = track_clip(clip)
    assert (track.quality[2, aside], track.quality[2, under]) == (STRAYED, HIDDEN)


@pytest.mark.slow
def test_what_a_blur_leaves_open_is_a_length(tmp_path: Path) -> None:
    """Pixels of half the size lose no more poses for it."""
    script = CLIP._replace(pace=lambda time: np.sin(2 * np.pi * 3 * time) ** 2)
    script = script._replace(view=view(120, 0.008), times=np.arange(14) / 30)
    clip = film_clip(script, tmp_path / "unused.mkv")
    assert errors(clip, track_clip(clip)).lost == 0.0


@pytest.mark.parametrize("pitch", [15, 10, 8])
@pytest.mark.parametrize("scaled", [False, True])
def test_too_few_pixels_are_told_with_their_number(pitch: int, scaled: bool) -> None:
    squares = specimen(GRID | {"grid": [6, 6]})
    still, shown = np.zeros((1, 36, 3)), View(size=(200, 200), scale=pitch / 15)
    image = eight_bit(Renderer(squares, lambda _: still, shown).frame(0.0))
    with refused(f"{pitch} px from unit to unit are too few", remedy="closer") as caught:
        track_video(iter([Frame(0, 0.0, image)]), squares, pitch / 15 if scaled else None)
    assert "20 px" in str(caught.value)


@pytest.mark.parametrize("fisheye", [0.0, 0.6])
def test_a_camera_of_averaged_pixels_sees_them(fisheye: float) -> None:
    """Blocks are averaged from the first pixel on; what is over at the far sides is cut off."""
    matrix = np.array([[8.0, 0.1, 60.0], [0.2, -8.0, 500.0], [1e-4, 0.0, 1.0]])
    camera = Camera(matrix, np.array([330.0, 255.0]), np.array([0.02, -0.01]), (643, 509))
    camera = replace(camera, fisheye=fisheye)
    points = np.random.default_rng(1).uniform([5, 10], [60, 50], (20, 2))
    coarse = camera.binned(4)
    assert coarse.size == (160, 127)
    expected: Floats = (camera.project(points) + 0.5) / 4 - 0.5
    np.testing.assert_allclose(coarse.project(points), expected, atol=1e-9)
    image = np.arange(508, dtype=np.float32)[:, None] * np.ones(640, np.float32)
    small = cv2.resize(image, (160, 127), interpolation=cv2.INTER_AREA)
    np.testing.assert_allclose(small[:, 0], (np.arange(127) + 0.5) * 4 - 0.5, rtol=1e-5)
