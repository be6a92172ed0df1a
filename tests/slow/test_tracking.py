"""Heavy clips of the tracker: dots and speckle against truth, and long recordings."""

import tracemalloc

import cv2
import numpy as np
import pytest

from pipeline.tracking.frames import Frame, import_video, read_frames
from pipeline.tracking.geometry import outlines_of_design
from pipeline.tracking.motion import track_video
from pipeline.tracking.motion.tracker import TrackedFrame, Tracker
from tests.pipeline.tracking.conftest import CLIPS, check_accuracy, tracked

_KEPT = 4 * 225 * 8  # bytes of poses, uncertainties and seen shares, single precision


@pytest.mark.parametrize(
    ("name", "translation", "rotation"), [("b_harmonic", 0.022, 0.09), ("e_speckle", 0.018, 0.04)]
)
def test_errors_are_parts_of_a_pixel(name: str, translation: float, rotation: float) -> None:
    check_accuracy(name, translation, rotation)


def test_speckled_units_agree_with_an_independent_correlation() -> None:
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


def _looped(monkeypatch: pytest.MonkeyPatch, length: int) -> int:
    """Bytes that the frames of a clip take at most, which is looped; each is fitted once."""
    described = import_video.description(CLIPS / "f_silhouette.yaml")
    images = [frame.image for frame in read_frames(CLIPS / "f_silhouette.mp4")][:3]
    fitted: list[TrackedFrame] = []
    step, count = Tracker.step, iter(range(length))

    def once(self: Tracker, image: np.ndarray, time: float) -> TrackedFrame:
        place = next(count) % len(images)
        if place == len(fitted):
            fitted.append(step(self, image, time))
        return fitted[place]

    monkeypatch.setattr(Tracker, "step", once)
    shown = (Frame(k, k / 300, images[k % len(images)]) for k in range(length))

    def tell() -> None:
        if not tracemalloc.is_tracing():
            tracemalloc.start()

    made = track_video(shown, outlines_of_design(import_video.design(described)), 2.7, tell)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    monkeypatch.undo()
    assert len(made.time) == length
    return most


def test_memory_grows_by_what_is_kept_of_a_frame_only(monkeypatch: pytest.MonkeyPatch) -> None:
    # uncertainties are calibrated in parts of 400 frames
    short, long = (_looped(monkeypatch, length) for length in (400, 800))
    assert long - short < 400 * 2.2 * _KEPT
