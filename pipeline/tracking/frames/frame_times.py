"""Tells times of frames, and how many of them a file promises."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import av
import numpy as np

from pipeline.runtime import UserError
from pipeline.tracking.frames.frame import Frame, untimed
from sim.core import Floats

_ROUNDED = 0.5
"""Part of an interval by which steady frames may differ: some containers count milliseconds."""

BARE = {"h264", "hevc", "m4v", "mjpeg"}
"""Kinds of files without stamps, to which FFmpeg may give those of 25 Hz."""

_BEGINNING = 8
"""Frames whose stamps show whether they are too coarse for the rate."""
_SOME, _SLACK = 32, 1.05
"""Frames at most that tell the interval; part of it by which rounded numbers may be longer."""
_ALL = 0.95
"""A video with less of the frames than this that its file promises breaks off."""


def has_uneven_intervals(time: Floats) -> bool:
    """Tells intervals of frames (frames,) s that differ by more than stamps are rounded."""
    interval = np.diff(time)
    return bool(len(interval) and np.ptp(interval) > _ROUNDED * np.median(interval))


def within_interval(frames: Iterator[Frame], lasting: Mapping[str, float]) -> Iterator[Frame]:
    """Yields the frames; refuses keys whose time, s, is longer than from a frame to the next.

    Raises:
        UserError: after some frames, as soon as they tell.
    """
    times: list[float] = []
    for frame in frames:
        if len(times) < _SOME:
            times.append(frame.time)
            if len(times) == _SOME:
                _check_lasting(times, lasting)
        yield frame
    if 1 < len(times) < _SOME:
        _check_lasting(times, lasting)


def _check_lasting(times: list[float], lasting: Mapping[str, float]) -> None:
    interval = float(np.median(np.diff(times)))
    if interval <= 0.0:  # times that do not tell are warned of elsewhere
        return
    for key, lasts in lasting.items():
        if lasts > _SLACK * interval:
            what = "longer than the interval between frames"
            remedy = f"give at most {1000 * interval:.3g} ms, the frames' interval; or correct"
            remedy = f"{remedy} frame_rate, in slow motion how many were taken in a second"
            raise UserError(what, key=key, value=f"{1000 * lasts:.6g} ms", remedy=remedy)


class FrameClock:
    """Tells times since the first frame, s: by the rate that is given, else by the stamps."""

    def __init__(self, path: Path, stream: av.VideoStream, rate: float | None) -> None:
        self._path, self._usual, self._rate = path, float(stream.average_rate or 1), rate
        self._bare = stream.container.format.name in BARE
        self._first: float | None = None
        self._instants: set[float] = set()
        self.lasted = 0.0  # by the stamps

    def __call__(self, index: int, frame: av.VideoFrame) -> float:
        """Reads the time of a frame; refuses a file whose stamps tell none apart.

        Raises:
            UserError: no rate is given, and there are no stamps, or too coarse ones.
        """
        if index == 0 and self._rate is None and (self._bare or frame.pts is None):
            raise untimed(self._path, "the file holds no times of its frames")
        stamp = index / self._usual if frame.pts is None else float(frame.time)
        self._first = stamp if self._first is None else self._first
        self.lasted = stamp - self._first
        if self._rate is not None:
            return index / self._rate
        if index < _BEGINNING:
            self._instants.add(stamp)
        if index == _BEGINNING - 1 and len(self._instants) <= _BEGINNING // 2:
            raise untimed(self._path, "most frames have the time of the one before")
        return self.lasted


def goes_on(
    container: av.container.InputContainer, stream: av.VideoStream, count: int, time: float
) -> bool:
    """Tells whether the file promises far more than so many frames, the last one at a time in s."""
    rate = (count - 1) / time if time > 0 else float(stream.average_rate or 0)
    return count < _ALL * promised_count(container, stream, rate)


def promised_count(
    container: av.container.InputContainer, stream: av.VideoStream, rate: float
) -> float:
    """Computes how many frames there are at least by the file; zero where it does not tell.

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
