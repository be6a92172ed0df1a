"""Reads frames of a video, or of a folder of numbered pictures (PNG, TIFF), with their times."""

import math
import re
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple, cast

import av
import numpy as np

from pipeline.runtime import Picture, UserError
from pipeline.tracking.frames.picture import WHITE, brightness, full_scale, page_count, read_levels
from sim.core import Floats

SYNTHETIC_LABEL = "SYNTHETIC"
"""Stands in the title or comment of a video that was rendered."""

_READY = {"gray", "yuv420p", "yuvj420p", "yuv422p", "yuvj422p", "yuv444p", "yuvj444p", "nv12"}
"""Formats whose first plane is the brightness in 8 bit, as it is."""

_ROUNDED = 0.5
"""Part of an interval by which steady frames may differ: some containers count milliseconds."""

_ALONE = {
    "protocol_whitelist": "file",
    "format_whitelist": "mov,mp4,matroska,webm,avi,asf,mpeg,mpegts,mxf,ogg,flv,nut,gif,h264,hevc",
}
"""Kinds of files that hold what they show: playlists name others, and may wait for more."""

_PAGED = {".tif", ".tiff"}
_SUFFIXES = {".png", *_PAGED}
_DEEP_WHITE = 65535.0
"""White of the frames that FFmpeg gives in 16 bit, however many the file has."""
_LUMA = np.array([0.299, 0.587, 0.114])
_COLOURFUL = 2.5
"""Colours that spread so many times more than luma are what tells units from the board."""
_SPARSE, _RANGE = 4, 200.0
_LARGEST = 1 << 27
"""Pixels of a frame."""

_AHEAD = 2
"""Frames that are decoded while one is looked at."""
_BEGINNING = 8
"""Frames whose stamps show whether they are too coarse for the rate."""
_ALL = 0.95
"""A video with less of the frames than this that its file promises breaks off."""


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


@dataclass(frozen=True)
class Frame:
    """Holds a picture of the video."""

    index: int  # from zero
    time: float  # since the file's first frame, s, by the rate that is given or the file's stamps
    image: Picture  # (rows, columns) brightness, from 0 to 255


def read_frames(
    path: Path, start: float = 0.0, end: float = float("inf"), rate: float | None = None
) -> Iterator[Frame]:
    """Decodes the video once, in sequence, a few frames ahead in a thread of its own.

    Args:
        path: the video, or a folder of pictures.
        start: of the time window, s; the first frame of the file is at zero.
        end: of the time window, s.
        rate: frames per second, in place of a video's own times; folders of pictures and bare
            streams have none.

    Raises:
        UserError: no such file, or none that can be read; one without times or a rate; one that
            is interlaced.
        BrokenOffError: after the frames that there are, if it breaks off or changes its size.
    """
    if not path.is_dir():
        yield from _ahead(_even(path, _filmed(path, start, end, rate)))
        return
    if rate is None:
        raise _untimed(path, "pictures have no times")
    shown = _pictured(path, rate)
    inside = takewhile(lambda frame: frame.time <= end, shown)
    yield from _even(path, (frame for frame in inside if start <= frame.time))


def _untimed(path: Path, what: str) -> UserError:
    remedy = "add how many were taken in a second, such as frame_rate: '300 Hz'"
    return UserError(what, file=path, key="frame_rate", remedy=remedy)


def frame_count(path: Path) -> int:
    """Counts frames as the file has it, at least one; the window and faults may make it less."""
    if path.is_dir():
        return len(pictures(path))
    try:
        with _opened(path) as container:
            stream = container.streams.video[0]
            return max(1, round(_promised(container, stream, float(stream.average_rate or 0))))
    except (av.FFmpegError, FileNotFoundError, IndexError):
        return 1


def has_uneven_intervals(time: Floats) -> bool:
    """Tells intervals of frames (frames,) s that differ by more than stamps are rounded."""
    interval = np.diff(time)
    return bool(len(interval) and np.ptp(interval) > _ROUNDED * np.median(interval))


def _ahead(frames: Iterator[Frame]) -> Iterator[Frame]:
    """Yields frames that a thread decodes meanwhile; its errors come after the frames before."""
    with ThreadPoolExecutor(1) as thread:
        coming = deque(thread.submit(next, frames, None) for _ in range(_AHEAD))
        while (frame := coming.popleft().result()) is not None:
            coming.append(thread.submit(next, frames, None))
            yield frame


def _even(path: Path, shown: Iterator[Frame]) -> Iterator[Frame]:
    """Yields the frames as long as they are of one size."""
    size, time = None, 0.0
    for frame in shown:
        size = frame.image.shape if size is None else size
        if frame.image.shape != size:
            raise broken_off(path, "it changes its size", frame.index, time)
        time = frame.time
        yield frame


def _pictured(path: Path, rate: float) -> Iterator[Frame]:
    count = 0
    try:
        for count, image in enumerate(images(path), start=1):
            yield Frame(count - 1, (count - 1) / rate, image)
    except UserError as error:
        if count == 0:
            raise
        raise broken_off(path, f"{error.file} cannot be read", count, (count - 1) / rate) from error


def _filmed(path: Path, start: float, end: float, rate: float | None) -> Iterator[Frame]:
    try:
        with _opened(path) as container:
            stream = _video_stream(container, path)
            yield from _decoded(container, stream, path, (start, end), rate)
    except FileNotFoundError as error:
        raise UserError("no such video", file=path, key="video", remedy="check the path") from error
    except av.FFmpegError as error:
        remedy = "give a video that ffprobe can read; copy the file again if it is broken"
        raise UserError(
            f"not a readable video: {error.strerror}", file=path, key="video", remedy=remedy
        ) from error


def _opened(path: Path) -> av.container.InputContainer:
    """Opens the file itself: neither an address that its name may be, nor others that it names."""
    if path.exists() and not path.is_file():
        raise UserError("not a plain file", file=path, key="video", remedy="give a video file")
    return av.open(f"file:{path}", options=_ALONE)


class _Shades:
    """Turns frames into brightness: luma, unless colours tell much more apart in the first one."""

    def __init__(self) -> None:
        self._axis: Floats | None = None
        self._begun = False

    def __call__(self, frame: av.VideoFrame) -> Picture:
        """Returns (rows, columns) brightness, from 0 to 255."""
        if not self._begun:
            self._begun, self._axis = True, _colour_axis(frame)
        if self._axis is None:
            return _brightness(frame)
        return _projected(frame, self._axis)


def _colour_axis(frame: av.VideoFrame) -> Floats | None:
    """Returns weights (3,) of red, green and blue with an offset last, or nothing for luma's.

    Luma is kept unless the colours' main direction spreads them far more.
    """
    if len(frame.format.components) < 3:
        return None
    colour = frame.to_ndarray(format="rgb24")[::_SPARSE, ::_SPARSE].reshape(-1, 3).astype(float)
    spread, axes = np.linalg.eigh(np.cov(colour.T))
    axis = axes[:, -1] * np.sign(axes[np.abs(axes[:, -1]).argmax(), -1])
    if np.sqrt(spread[-1]) < _COLOURFUL * float((colour @ _LUMA).std()):
        return None
    low, high = np.percentile(colour @ axis, [1, 99])
    gain = _RANGE / max(float(high - low), 1e-9)
    return np.append(axis * gain, 0.5 * (WHITE - gain * (high + low)))


def _projected(frame: av.VideoFrame, axis: Floats) -> Picture:
    deep = max(part.bits for part in frame.format.components) > 8
    colour = frame.to_ndarray(format="rgb48le" if deep else "rgb24").astype(np.float32)
    weights = (axis[:3] / (257.0 if deep else 1.0)).astype(np.float32)
    return np.asarray(np.clip(colour @ weights + np.float32(axis[3]), 0, WHITE), np.float32)


def _video_stream(container: av.container.InputContainer, path: Path) -> av.VideoStream:
    # a file cut off within its index has a stream of which nothing tells how to decode it
    if not container.streams.video or container.streams.video[0].codec_context is None:
        raise UserError("the file holds no video", file=path, remedy="give a video file")
    stream = container.streams.video[0]
    if stream.width * stream.height > _LARGEST:
        size = f"{stream.width} x {stream.height}"
        remedy = "give a smaller one, or one that is not broken"
        raise UserError(f"frames of {size} pixels are too large", file=path, remedy=remedy)
    return stream


class _Clock:
    """Tells times since the first frame, s: by the rate that is given, else by the stamps."""

    def __init__(self, path: Path, stream: av.VideoStream, rate: float | None) -> None:
        self._path, self._usual, self._rate = path, float(stream.average_rate or 1), rate
        self._first: float | None = None
        self._instants: set[float] = set()
        self.lasted = 0.0  # by the stamps

    def __call__(self, index: int, frame: av.VideoFrame) -> float:
        """Reads the time of a frame; refuses a file whose stamps tell none apart.

        Raises:
            UserError: no rate is given, and there are no stamps, or too coarse ones.
        """
        if index == 0 and self._rate is None and frame.pts is None:
            raise _untimed(self._path, "the file holds no times of its frames")
        stamp = index / self._usual if frame.pts is None else float(frame.time)
        self._first = stamp if self._first is None else self._first
        self.lasted = stamp - self._first
        if self._rate is not None:
            return index / self._rate
        if index < _BEGINNING:
            self._instants.add(stamp)
        if index == _BEGINNING - 1 and len(self._instants) <= _BEGINNING // 2:
            raise _untimed(self._path, "most frames have the time of the one before")
        return self.lasted


def _decoded(
    container: av.container.InputContainer,
    stream: av.VideoStream,
    path: Path,
    window: tuple[float, float],
    rate: float | None,
) -> Iterator[Frame]:
    index, time, (start, end) = 0, 0.0, window
    decoded, shades, clock = iter(container.decode(stream)), _Shades(), _Clock(path, stream, rate)
    while time < end:
        try:
            frame = next(decoded, None)
        except av.FFmpegError as error:
            if index == 0:
                raise
            raise broken_off(path, str(error.strerror), index, time) from error
        if frame is None:
            if _goes_on(container, stream, index, clock.lasted):
                raise broken_off(path, "the file should go on", index, time)
            return
        time = clock(index, frame)
        if time > end:
            return
        if time >= start:
            _check_progressive(frame, path)
            yield Frame(index, time, _orientation(frame).shown(shades(frame)))
        index += 1


def _check_progressive(frame: av.VideoFrame, path: Path) -> None:
    """Refuses a frame of two fields, whose odd rows show another instant than the even ones."""
    if frame.interlaced_frame:
        remedy = (
            f"deinterlace it first, e.g. ffmpeg -i {path.name} -vf bwdif OUT.mp4, or, if the camera"
            " took all rows at once, -vf setfield=prog"
        )
        raise UserError("the video is interlaced", file=path, key="video", remedy=remedy)


def _goes_on(
    container: av.container.InputContainer, stream: av.VideoStream, count: int, time: float
) -> bool:
    """Tells whether the file promises far more than so many frames, the last one at a time in s."""
    rate = (count - 1) / time if time > 0 else float(stream.average_rate or 0)
    return count < _ALL * _promised(container, stream, rate)


def _promised(container: av.container.InputContainer, stream: av.VideoStream, rate: float) -> float:
    """Computes how many frames there are at least by the file; zero where it does not tell.

    Of a rate, those of its duration are as many: an edit list shows less than is held, and a frame
    that a camera drops may be counted.
    """
    duration = _duration(container, stream)
    told = [float(stream.frames)] if stream.frames else []
    return min([*told, rate * duration - 1] if duration else told, default=0.0)


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


class Orientation(NamedTuple):
    """Tells how players show a frame, by the file: a phone tells how it was held, or mirrors it.

    Attributes:
        transposed: whether rows are shown as columns, before these are reversed.
        rows_reversed: whether what is then the last row is shown first.
        columns_reversed: likewise.
    """

    transposed: bool = False
    rows_reversed: bool = False
    columns_reversed: bool = False

    def shown(self, image: Picture) -> Picture:
        """Turns and mirrors the brightness as players show it."""
        rows, columns = (-1 if each else 1 for each in self[1:])
        image = (image.T if self.transposed else image)[::rows, ::columns]
        return cast("Picture", np.ascontiguousarray(image))


def _orientation(frame: av.VideoFrame) -> Orientation:
    """Reads the matrix by which pixels (x, y, 1), y down, go to their places, if there is one."""
    matrix = frame.side_data.get("DISPLAYMATRIX")
    if matrix is None:
        return Orientation()
    (a, b), (c, d) = np.frombuffer(cast("bytes", matrix), np.int32).reshape(3, 3)[:2, :2].tolist()
    transposed = abs(b) + abs(c) > abs(a) + abs(d)
    x, y = (c, b) if transposed else (a, d)
    return Orientation(transposed, rows_reversed=y < 0, columns_reversed=x < 0)


def orientation_of(video: Path) -> Orientation:
    """Reads how frames are turned and mirrored as they are read.

    Those of a file that cannot be read are not: reading its frames tells what is wrong.
    """
    if not video.is_file():
        return Orientation()
    try:
        with _opened(video) as container:
            frame = next(iter(container.decode(container.streams.video[0])), None)
            return Orientation() if frame is None else _orientation(frame)
    except (av.FFmpegError, IndexError, UserError):
        return Orientation()


def _brightness(frame: av.VideoFrame) -> Picture:
    if max(part.bits for part in frame.format.components) > 8:
        return brightness(frame.to_ndarray(format="gray16le"), _DEEP_WHITE)
    if frame.format.name not in _READY:
        return np.asarray(frame.to_ndarray(format="gray"), np.uint8)
    plane = frame.planes[0]
    rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, plane.line_size)
    return np.ascontiguousarray(rows[:, : plane.width])


def pictures(folder: Path) -> list[Path]:
    """Lists the folder's pictures in the order of the numbers in their names.

    Raises:
        UserError: there are none.
    """
    found = [
        path
        for path in folder.iterdir()
        if path.suffix.lower() in _SUFFIXES and not path.name.startswith(".")
    ]
    if not found:
        remedy = "give a video file, or a folder of numbered .png or .tif files"
        raise UserError("the folder holds no pictures", file=folder, remedy=remedy)
    return sorted(found, key=_numbers)


def _numbers(path: Path) -> tuple[list[int], str]:
    return [int(digits) for digits in re.findall(r"\d+", path.stem)], path.name


def images(folder: Path) -> Iterator[Picture]:
    """Reads their brightness, one after the other.

    The first, the last and the one between tell how many levels the camera has.

    Raises:
        UserError: one cannot be read, or holds several.
    """
    found = pictures(folder)
    some = (read_levels(found[place]) for place in (0, len(found) // 2, -1))
    top = full_scale([levels for levels in some if levels is not None])
    for path in found:
        if (levels := read_levels(path)) is None:
            raise UserError("not a readable picture", file=path, remedy="write the file again")
        if path.suffix.lower() in _PAGED and (count := page_count(path)) > 1:
            what = f"there are {count} pictures in one file"
            remedy = f"write each to a file, e.g. magick {path.name} {path.stem}_%05d.tif"
            raise UserError(what, file=path, key="video", remedy=remedy)
        yield brightness(levels, top)


def rendered(video: Path) -> bool:
    """Reads whether the file's metadata call it synthetic; a folder of pictures has none.

    A file that cannot be read counts as filmed: reading its frames tells what is wrong.
    """
    if not video.is_file():
        return False
    try:
        with av.open(str(video)) as container:
            return any(SYNTHETIC_LABEL in text for text in container.metadata.values())
    except av.FFmpegError:
        return False
