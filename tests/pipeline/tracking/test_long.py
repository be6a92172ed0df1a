"""Recordings that are long: what is kept of them."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from pipeline.tracking.frames import Frame, import_video, read_frames
from pipeline.tracking.geometry import outlines_of_design
from pipeline.tracking.motion import track_video
from pipeline.tracking.motion.tracker import TrackedFrame, Tracker
from tests.pipeline.tracking.conftest import CLIPS

_KEPT = 4 * 225 * 6  # bytes of poses and uncertainties, single precision


def _looped(monkeypatch: pytest.MonkeyPatch, length: int) -> int:
    """Bytes that the frames of a clip take at most, which is looped; each is fitted once."""
    described = import_video.description(CLIPS / "f_silhouette.yaml")
    images = [frame.image for frame in read_frames(CLIPS / "f_silhouette.mp4")][:3]
    fitted: list[TrackedFrame] = []
    step, count = Tracker.step, iter(range(length))

    def once(self: Tracker, image: np.ndarray) -> TrackedFrame:
        place = next(count) % len(images)
        if place == len(fitted):
            fitted.append(step(self, image))
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
    short, long = (_looped(monkeypatch, length) for length in (500, 900))
    assert long - short < 400 * 2.5 * _KEPT
