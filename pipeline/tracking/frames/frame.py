"""Holds one picture of a video, and the errors of videos that end early or tell no times."""

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


class BrokenOffError(UserError):
    """Tells of a video that ends too early: the frames before are whole, their track is kept."""


def broken_off(path: Path, why: str, count: int, time: float) -> BrokenOffError:
    """Reports a file that holds no more than so many frames, the last one at a time in s."""
    until = math.floor(1000 * time) / 1000
    return BrokenOffError(
        f"the video breaks off after {count} frames, which are tracked: {why}",
        file=path,
        key="video",
        remedy=f"copy the file again, or end there: `window: {{end: {until:g} s}}`",
    )


class UntimedError(UserError):
    """Tells of a file without times of its frames, for which no rate is given."""


def untimed(path: Path, what: str) -> UntimedError:
    """Reports such a file."""
    remedy = "add how many were taken in a second, such as frame_rate: '300 Hz'"
    return UntimedError(what, file=path, key="frame_rate", remedy=remedy)
