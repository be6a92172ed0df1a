"""Trackers are timed alike: from the second frame on, and the first one for itself."""

from itertools import count
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.tracking import frame_rates
from pipeline.tracking.frames import Frame

FRAMES: Any = [SimpleNamespace(image=np.zeros((2, 2)))] * 5


@pytest.mark.parametrize("method", frame_rates.METHODS)
def test_the_first_frame_is_timed_apart(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between two looks at the clock, one second."""
    track = SimpleNamespace(displacement=np.zeros(()), calibration=SimpleNamespace(pixel=1.0))

    def ours(frames: Any, _: object, __: float, tell: Any) -> object:  # noqa: ANN401
        for _frame in frames:
            tell()
        return track

    def theirs(images: Any, *_: object) -> object:  # noqa: ANN401
        return np.zeros(len([*images]))

    monkeypatch.setattr(frame_rates, "track_video", ours)
    monkeypatch.setattr("benchmarks.tracking.plain_opencv.track", theirs)
    monkeypatch.setattr("time.process_time", count().__next__)
    video: Any = SimpleNamespace(specimen=None, scale=1.0)
    frames: list[Frame] = FRAMES
    found = frame_rates.track_timed(video, frames, method)
    assert (found.first, found.each) == (1, 5 / 4)  # four frames, and what follows the last
