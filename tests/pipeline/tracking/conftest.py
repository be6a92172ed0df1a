from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from pipeline.tracking import importing
from pipeline.tracking.follow import Track, follow
from pipeline.tracking.specimen import Specimen, of_design
from pipeline.tracking.video import frames

CLIPS = Path(__file__).parents[2] / "data/tracking"


class Tracked(NamedTuple):
    """A clip, tracked, with the errors in px, px and deg."""

    specimen: Specimen
    track: Track
    error: np.ndarray


@pytest.fixture(scope="session")
def tracked() -> Callable[[str], Tracked]:
    """Tracks a clip of tests/data/tracking, once."""

    @cache
    def of(name: str) -> Tracked:
        described = importing.description(CLIPS / f"{name}.yaml")
        specimen = of_design(importing.design(described))
        video = importing.video_of(CLIPS / f"{name}.yaml")
        track = follow(frames(video), specimen, described["approx_px_per_mm"])
        truth = np.load(CLIPS / f"{name}_truth.npz")["displacement"]
        scale = np.array([1 / track.calibration.pixel] * 2 + [180 / np.pi])
        return Tracked(specimen, track, (track.displacement - truth) * scale)

    return of
