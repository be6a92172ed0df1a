from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.tracking.frames import import_video, read_frames
from pipeline.tracking.geometry import SpecimenOutlines, outlines_of_design
from pipeline.tracking.motion import Track, track_video

CLIPS = Path(__file__).parents[2] / "data/tracking"


class Tracked(NamedTuple):
    """Holds a clip, tracked, with the errors in px, px and deg."""

    specimen: SpecimenOutlines
    track: Track
    error: np.ndarray


@cache
def tracked(name: str) -> Tracked:
    """Tracks a clip of tests/data/tracking, once."""
    described = import_video.description(CLIPS / f"{name}.yaml")
    specimen = outlines_of_design(import_video.design(described))
    video = import_video.video_of(CLIPS / f"{name}.yaml")
    track = track_video(read_frames(video), specimen, described["approx_px_per_mm"])
    truth = np.load(CLIPS / f"{name}_truth.npz")["displacement"]
    scale = np.array([1 / track.calibration.pixel] * 2 + [180 / np.pi])
    return Tracked(specimen, track, (track.displacement - truth) * scale)


def check_accuracy(name: str, translation: float, rotation: float) -> None:
    """Checks root mean squares of the errors of a clip: px, deg."""
    error = tracked(name).error
    assert np.isfinite(error).all()
    rms = np.sqrt(np.mean(error**2, axis=(0, 1)))
    assert (rms < [translation, translation, rotation]).all()
    assert (tracked(name).track.timing == 0).all()
