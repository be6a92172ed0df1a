"""Reads times of frames, and how many of them a file declares."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import av
import numpy as np

from pipeline.runtime import UserError
from pipeline.tracking.frames.frame import Frame, missing_times
from sim.core import Floats

_TOLERANCE = 0.5
"""Part of an interval by which steady frames may differ: some containers count milliseconds."""

ELEMENTARY_STREAMS = {"h264", "hevc", "m4v", "mjpeg"}
"""Kinds of files without stamps, to which FFmpeg may give those of 25 Hz."""

_FIRST_FRAMES = 8
"""Frames whose stamps show whether they are too coarse for the rate."""
_INTERVAL_FRAMES, _SLACK = 32, 1.05
"""Frames at most that tell the interval; part of it by which rounded numbers may be longer."""
_COMPLETE_SHARE = 0.95
"""Least share of the declared frames that a complete video holds."""


def has_uneven_intervals(time: Floats) -> bool:
    """Tests for intervals of frames (frames,), s, that differ by more than stamps are rounded."""
    interval = np.diff(time)
    return bool(len(interval) and np.ptp(interval) > _TOLERANCE * np.median(interval))


def check_durations(frames: Iterator[Frame], durations: Mapping[str, float]) -> Iterator[Frame]:
    """Yields the frames; refuses keys whose time, s, is longer than from a frame to the next.

    Raises:
        UserError: after some frames, as soon as they tell.
    """
    times: list[float] = []
    for frame in frames:
        if len(times) < _INTERVAL_FRAMES:
            times.append(frame.time)
            if len(times) == _INTERVAL_FRAMES:
                _check_interval(times, durations)
        yield frame
    if 1 < len(times) < _INTERVAL_FRAMES:
        _check_interval(times, durations)


def _check_interval(times: list[float], durations: Mapping[str, float]) -> None:
    interval = float(np.median(np.diff(times)))
    if interval <= 0.0:  # times that do not tell are warned of elsewhere
        return
    for key, duration in durations.items():
        if duration > _SLACK * interval:
            what = "longer than the interval between frames"
            remedy = f"give at most {1000 * interval:.3g} ms, the frames' interval; or correct"
            remedy = f"{remedy} frame_rate, in slow motion how many were taken in a second"
            raise UserError(what, key=key, value=f"{1000 * duration:.6g} ms", remedy=remedy)


class FrameClock:
    """Computes times since the first frame, s: by the rate that is given, else by the stamps."""

    def __init__(self, path: Path, stream: av.VideoStream, rate: float | None) -> None:
        self._path, self._usual, self._rate = path, float(stream.average_rate or 1), rate
        self._elementary = stream.container.format.name in ELEMENTARY_STREAMS
        self._first: float | None = None
        self._instants: set[float] = set()
        self.elapsed = 0.0  # by the stamps

    def __call__(self, index: int, frame: av.VideoFrame) -> float:
        """Reads the time of a frame; refuses a file whose stamps tell none apart.

        Raises:
            UserError: no rate is given, and there are no stamps, or too coarse ones.
        """
        if index == 0 and self._rate is None and (self._elementary or frame.pts is None):
            raise missing_times(self._path, "the file holds no times of its frames")
        stamp = index / self._usual if frame.pts is None else float(frame.time)
        self._first = stamp if self._first is None else self._first
        self.elapsed = stamp - self._first
        if self._rate is not None:
            return index / self._rate
        if index < _FIRST_FRAMES:
            self._instants.add(stamp)
        if index == _FIRST_FRAMES - 1 and len(self._instants) <= _FIRST_FRAMES // 2:
            raise missing_times(self._path, "most frames have the time of the one before")
        return self.elapsed


def is_truncated(
    container: av.container.InputContainer, stream: av.VideoStream, count: int, time: float
) -> bool:
    """Tests whether the file declares far more than `count` frames, the last one at a time in s."""
    rate = (count - 1) / time if time > 0 else float(stream.average_rate or 0)
    return count < _COMPLETE_SHARE * declared_count(container, stream, rate)


def declared_count(
    container: av.container.InputContainer, stream: av.VideoStream, rate: float
) -> float:
    """Computes the least number of frames that the file declares; zero where it declares none.

    Of a rate, those of its duration are as many: an edit list shows less than is held, and a frame
    that a camera drops may be counted.
    """
    duration = _duration(container, stream)
    told = [float(stream.frames)] if stream.frames else []
    return min([*told, rate * duration - 1] if duration else told, default=0.0)


def stream_length(
    container: av.container.InputContainer, stream: av.VideoStream, rate: float | None
) -> float:
    """Computes how long the video is by the file, s, at a rate in place of the file's own times.

    It is infinite where the file does not tell.
    """
    told = stream.frames / rate if rate else _duration(container, stream)
    return told or math.inf


def _duration(container: av.container.InputContainer, stream: av.VideoStream) -> float:
    """Reads how long the frames are shown by the file, s; zero where it does not tell.

    An AVI counts the places of frames, and is taken to be as long as its size tells if it is cut.
    """
    if container.format.name == "avi" and stream.average_rate:
        return float(stream.frames / stream.average_rate)
    if stream.duration and stream.time_base:
        return float(stream.duration * stream.time_base)
    if len(container.streams) > 1 or not container.duration:
        return 0.0
    return (container.duration - max(container.start_time or 0, 0)) / av.time_base
