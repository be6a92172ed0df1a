"""Holds one picture of a video, and the errors of truncated videos and missing times."""

import math
from dataclasses import dataclass
from pathlib import Path

from pipeline.runtime import Picture, UserError


@dataclass(frozen=True)
class Frame:
    """Holds a picture of the video."""

    index: int  # from zero
    time: float  # since the file's first frame, s, by the rate that is given or the file's stamps
    image: Picture  # (rows, columns) brightness, from 0 to 255


class TruncatedVideoError(UserError):
    """Reports a video that ends too early; the frames before are complete, their track is kept."""


def truncated_video(path: Path, why: str, count: int, time: float) -> TruncatedVideoError:
    """Makes the error of a file with no more than `count` frames, the last one at a time in s."""
    until = math.floor(1000 * time) / 1000
    return TruncatedVideoError(
        f"the video breaks off after {count} frames, which are tracked: {why}",
        file=path,
        key="video",
        remedy=f"copy the file again, or end there: `window: {{end: {until:g} s}}`",
    )


class MissingTimesError(UserError):
    """Reports a file without times of its frames, for which no rate is given."""


def missing_times(path: Path, what: str) -> MissingTimesError:
    """Makes the error of such a file."""
    remedy = "add how many were taken in a second, such as frame_rate: '300 Hz'"
    return MissingTimesError(what, file=path, key="frame_rate", remedy=remedy)
