from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from pipeline.tracking.frames import import_video, read_frames
from tests.pipeline.tracking.conftest import CLIPS, Tracked

Clips = Callable[[str], Tracked]

BARS = {
    "b_harmonic": (0.022, 0.09),
    "c_rigid_lossless": (0.007, 0.04),
    "e_speckle": (0.018, 0.04),
    "f_silhouette": (0.016, 0.09),
}


@pytest.mark.parametrize("name", BARS)
def test_every_unit_is_followed_to_a_fraction_of_a_pixel(name: str, tracked: Clips) -> None:
    error = tracked(name).error
    assert np.isfinite(error).all()
    translation, rotation = BARS[name]
    assert np.sqrt(np.mean(error[..., 0] ** 2)) < translation
    assert np.sqrt(np.mean(error[..., 1] ** 2)) < translation
    assert np.sqrt(np.mean(error[..., 2] ** 2)) < rotation
    assert (tracked(name).track.timing == 0).all()


def test_translations_without_loss_have_no_bias(tracked: Clips) -> None:
    error = tracked("c_rigid_lossless").error[1:3]
    assert np.abs(error[..., :2].mean(axis=(0, 1))).max() < 0.001
    assert np.sqrt(np.mean(error[..., :2] ** 2)) < 0.005


def test_the_uncertainty_is_of_the_size_of_the_error(tracked: Clips) -> None:
    found = tracked("b_harmonic")
    scale = np.array([1 / found.track.calibration.pixel] * 2 + [180 / np.pi])
    standard = (found.error / (found.track.sigma * scale))[1:]
    assert (standard.std(axis=(0, 1)) > 0.5).all()
    assert (standard.std(axis=(0, 1)) < 2.0).all()


def test_speckled_units_agree_with_an_independent_correlation(tracked: Clips) -> None:
    """OpenCV's ECC on a crop about each of some units, as a Euclidean motion of the image."""
    found = tracked("e_speckle")
    video = import_video.video_of(CLIPS / "e_speckle.yaml")
    images = [frame.image for frame in read_frames(video)]
    camera, last = found.track.calibration.camera, len(images) - 1
    everywhere = np.full_like(images[0], 255)
    half = int(0.33 * found.specimen.pitch / found.track.calibration.pixel)
    apart = []
    for unit in range(7, found.specimen.count, 31):
        rest = found.specimen.centre[unit]
        moved = rest + found.track.displacement[last, unit, :2]
        column, row = np.round(camera.project(rest)).astype(int)
        shown = images[0][row - half : row + half + 1, column - half : column + half + 1]
        start = np.array([[1, 0, column - half], [0, 1, row - half]], np.float32)
        start[:, 2] += camera.project(moved) - camera.project(rest)
        criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-6)
        _, warp = cv2.findTransformECC(
            shown, images[last], start, cv2.MOTION_EUCLIDEAN, criteria, everywhere, 1
        )
        middle = camera.project(rest) - (column - half, row - half)
        apart.append(warp[:, :2] @ middle + warp[:, 2] - camera.project(moved))
    assert np.sqrt(np.mean(np.square(apart))) < 0.05
