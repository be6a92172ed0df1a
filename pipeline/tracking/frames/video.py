"""Reads frames of a video, or of a folder of numbered pictures, with their times."""

import math
import shlex
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import av

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.runtime import UserError
from pipeline.tracking.frames.decoded_picture import BrightnessConverter, Orientation, orientation
from pipeline.tracking.frames.frame import Frame, truncated_video
from pipeline.tracking.frames.frame_times import (
    ELEMENTARY_STREAMS,
    FrameClock,
    is_truncated,
    stream_length,
)
from pipeline.tracking.frames.picture_folder import frame_indices, pictures, read_folder

_FORMATS = {
    ".mp4": "mov",
    ".mkv": "matroska",
    ".avi": "avi",
    ".mov": "mov",
    ".m4v": "mov,m4v",
    ".3gp": "mov",
    ".webm": "matroska",
    ".wmv": "asf",
    ".asf": "asf",
    ".mpg": "mpeg",
    ".mpeg": "mpeg",
    ".ts": "mpegts",
    ".mts": "mpegts",
    ".m2ts": "mpegts",
    ".mxf": "mxf",
    ".ogv": "ogg",
    ".flv": "flv",
    ".nut": "nut",
    ".gif": "gif",
    ".cine": "cine",
    ".y4m": "yuv4mpegpipe",
    ".ivf": "ivf",
    ".mjpeg": "mjpeg",
    ".mjpg": "mjpeg",
    ".h264": "h264",
    ".264": "h264",
    ".hevc": "hevc",
    ".265": "hevc",
}
"""FFmpeg's names of the files that hold what they show: playlists name others, and may wait."""

VIDEOS = tuple(_FORMATS)
"""Ends of their names."""

_OPTIONS = {"protocol_whitelist": "file", "format_whitelist": ",".join(_FORMATS.values())}

_MOST_PIXELS = 1 << 27
"""Pixels of a frame."""

_PREFETCHED = 2
"""Frames that are decoded while one is looked at."""


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
        TruncatedVideoError: after the frames that there are, if it breaks off or changes its size.
    """
    if path.is_dir():
        yield from _check_size(path, read_folder(path, start, end, rate))
    else:
        yield from _prefetch(_check_size(path, _decode(path, start, end, rate)))


def frame_count(path: Path) -> int:
    """Counts frames as the file has it, at least one; the window and faults may make it less."""
    if path.is_dir():
        return len(pictures(path))
    try:
        with open_video(path) as container:
            stream = container.streams.video[0]
            length = stream_length(container, stream, None)
            shown = float(stream.average_rate or 0.0) * length if math.isfinite(length) else 0.0
            return max(1, stream.frames or round(shown))
    except (av.FFmpegError, FileNotFoundError, IndexError):
        return 1


def declared_rate(path: Path) -> float | None:
    """Reads the frames per second that a video tells; None where it tells none."""
    if path.is_dir():
        return None
    try:
        with open_video(path) as container:
            rate = container.streams.video[0].average_rate
            return None if container.format.name in ELEMENTARY_STREAMS or not rate else float(rate)
    except (av.FFmpegError, FileNotFoundError, IndexError):
        return None


def video_length(path: Path, rate: float | None = None) -> float:
    """Reads how long a video is, s, at a rate if one is given; infinite where nothing tells."""
    if path.is_dir():
        return (frame_indices(pictures(path))[-1] + 1) / rate if rate else math.inf
    try:
        with open_video(path) as container:
            return stream_length(container, container.streams.video[0], rate)
    except (av.FFmpegError, FileNotFoundError, IndexError):
        return math.inf


def _prefetch(frames: Iterator[Frame]) -> Iterator[Frame]:
    """Yields frames that a thread decodes meanwhile; its errors come after the frames before."""
    with ThreadPoolExecutor(1) as thread:
        coming = deque(thread.submit(next, frames, None) for _ in range(_PREFETCHED))
        while (frame := coming.popleft().result()) is not None:
            coming.append(thread.submit(next, frames, None))
            yield frame


def _check_size(path: Path, shown: Iterator[Frame]) -> Iterator[Frame]:
    """Yields the frames as long as they are of one size."""
    size, time = None, 0.0
    for frame in shown:
        size = frame.image.shape if size is None else size
        if frame.image.shape != size:
            raise truncated_video(path, "it changes its size", frame.index, time)
        time = frame.time
        yield frame


def _decode(path: Path, start: float, end: float, rate: float | None) -> Iterator[Frame]:
    try:
        with open_video(path) as container:
            stream = _video_stream(container, path)
            yield from _frames_in_window(container, stream, path, (start, end), rate)
    except FileNotFoundError as error:
        raise UserError("no such video", file=path, key="video", remedy="check the path") from error
    except av.FFmpegError as error:
        remedy = (
            "copy the file again from the camera; if a player shows it, save it from there as an"
            " .mp4 (H.264), or as numbered .png pictures in a folder"
        )
        raise UserError(
            f"not a readable video: {error.strerror}", file=path, key="video", remedy=remedy
        ) from error


def open_video(path: Path) -> av.container.InputContainer:
    """Opens the file itself: neither an address that its name may be, nor others that it names.

    Raises:
        UserError: it is no plain file, or of a kind that is not read.
    """
    if path.exists() and not path.is_file():
        raise UserError("not a plain file", file=path, key="video", remedy="give a video file")
    try:
        return av.open(f"file:{path}", options=_OPTIONS)
    except av.ArgumentError as error:
        ends = shlex.quote(path.name), shlex.quote(f"{path.stem}_ffv1.mkv")
        made = "ffmpeg -i {} -c:v ffv1 {}".format(*ends)
        remedy = f"convert it, e.g. {made}; copy the file again if it is broken"
        what = "not a readable video: files of this kind are not read"
        raise UserError(what, file=path, key="video", remedy=remedy) from error


def _video_stream(container: av.container.InputContainer, path: Path) -> av.VideoStream:
    # a file cut off within its index has a stream of which nothing tells how to decode it
    if not container.streams.video or container.streams.video[0].codec_context is None:
        raise UserError("the file holds no video", file=path, remedy="give a video file")
    stream = container.streams.video[0]
    if stream.width * stream.height > _MOST_PIXELS:
        size = f"{stream.width} x {stream.height}"
        remedy = "give a smaller one, or one that is not broken"
        raise UserError(f"frames of {size} pixels are too large", file=path, remedy=remedy)
    return stream


def _frames_in_window(
    container: av.container.InputContainer,
    stream: av.VideoStream,
    path: Path,
    window: tuple[float, float],
    rate: float | None,
) -> Iterator[Frame]:
    index, time, (start, end) = 0, 0.0, window
    decoded, shades, clock = (
        iter(container.decode(stream)),
        BrightnessConverter(),
        FrameClock(path, stream, rate),
    )
    while time < end:
        try:
            frame = next(decoded, None)
        except av.FFmpegError as error:
            if index == 0:
                raise
            raise truncated_video(path, str(error.strerror), index, time) from error
        if frame is None:
            if is_truncated(container, stream, index, clock.elapsed):
                raise truncated_video(path, "the file should go on", index, time)
            return
        time = clock(index, frame)
        if time > end:
            return
        if time >= start:
            _check_progressive(frame, path)
            yield Frame(index, time, orientation(frame).shown(shades(frame)))
        index += 1


def _check_progressive(frame: av.VideoFrame, path: Path) -> None:
    """Refuses a frame of two fields, whose odd rows show another instant than the even ones."""
    if frame.interlaced_frame:
        remedy = (
            f"deinterlace it first, e.g. ffmpeg -i {shlex.quote(path.name)} -vf bwdif OUT.mp4, or,"
            " if the camera took all rows at once, with setfield=prog in place of bwdif"
        )
        raise UserError("the video is interlaced", file=path, key="video", remedy=remedy)


def orientation_of(video: Path) -> Orientation:
    """Reads how frames are turned and mirrored as they are read.

    Those of a file that cannot be read are not: reading its frames tells what is wrong.
    """
    if not video.is_file():
        return Orientation()
    try:
        with open_video(video) as container:
            frame = next(iter(container.decode(container.streams.video[0])), None)
            return Orientation() if frame is None else orientation(frame)
    except (av.FFmpegError, IndexError, UserError):
        return Orientation()


def rendered(video: Path) -> bool:
    """Reads whether the file's metadata call it synthetic; a folder of pictures has none.

    A file that cannot be read counts as filmed: reading its frames tells what is wrong.
    """
    if not video.is_file():
        return False
    try:
        with open_video(video) as container:
            return any(SYNTHETIC_LABEL in text for text in container.metadata.values())
    except (av.FFmpegError, UserError):
        return False
