from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from pipeline.tracking.frames import import_video, read_frames
from pipeline.tracking.geometry import SpecimenOutlines, outlines_of_design
from pipeline.tracking.motion import Track, track_video

CLIPS = Path(__file__).parents[2] / "data/tracking"


class Tracked(NamedTuple):
    """A clip, tracked, with the errors in px, px and deg."""

    specimen: SpecimenOutlines
    track: Track
    error: np.ndarray


@pytest.fixture(scope="session")
def tracked() -> Callable[[str], Tracked]:
    """Tracks a clip of tests/data/tracking, once."""

    @cache
    def of(name: str) -> Tracked:
        described = import_video.description(CLIPS / f"{name}.yaml")
        specimen = outlines_of_design(import_video.design(described))
        video = import_video.video_of(CLIPS / f"{name}.yaml")
        track = track_video(read_frames(video), specimen, described["approx_px_per_mm"])
        truth = np.load(CLIPS / f"{name}_truth.npz")["displacement"]
        scale = np.array([1 / track.calibration.pixel] * 2 + [180 / np.pi])
        return Tracked(specimen, track, (track.displacement - truth) * scale)

    return of
