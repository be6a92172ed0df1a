"""Writes frames as a video: the same frames give the same bytes."""

from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from pipeline.problem.sections import Codec
from pipeline.runtime import write_atomically
from sim.core import Image

_TICKS = 90000  # per second: a usual clock of containers
_QUEUE_LENGTH = 4  # frames that wait for the encoder at most


def encode_video(
    path: Path, images: Iterable[Image], rate: float, codec: Codec, labels: dict[str, str]
) -> None:
    """Writes the video, whole or not at all; its name should have one of the codec's `suffixes`.

    Images are grey, (rows, columns), or in colour, (rows, columns, 3), which ffv1 does not take;
    the rate is in frames per second; labels are the file's title and comment.
    """
    with (
        write_atomically(path) as aside,
        av.open(str(aside), "w", options={"fflags": "+bitexact"}) as container,
    ):
        container.metadata.update(labels)
        _write(container, images, rate, codec)


def _write(
    container: av.container.OutputContainer, images: Iterable[Image], rate: float, codec: Codec
) -> None:
    """Encodes images in a thread of its own while the next ones are made."""
    lossless, stream = codec.name == "ffv1", None
    waiting: deque[Future[None]] = deque()
    with ThreadPoolExecutor(1) as thread:
        for index, image in enumerate(images):
            planes = image if lossless else _to_planes(image)
            if stream is None:
                stream = _stream(container, planes, rate, codec)
            frame = av.VideoFrame.from_ndarray(planes, format="gray" if lossless else "yuv420p")
            frame.pts, frame.time_base = round(index * _TICKS / rate), Fraction(1, _TICKS)
            waiting.append(thread.submit(_encode, container, stream, frame))
            if len(waiting) > _QUEUE_LENGTH:
                waiting.popleft().result()
        for each in waiting:
            each.result()
    if stream is not None:
        _encode(container, stream, None)


def _encode(
    container: av.container.OutputContainer, stream: av.VideoStream, frame: av.VideoFrame | None
) -> None:
    """Writes what the encoder has ready after a frame, or all that is left after the last one."""
    container.mux(stream.encode(frame))


def _to_planes(image: Image) -> Image:
    """Brightness and, below it, colour at half the resolution; sides are made even."""
    odd = [(0, side % 2) for side in image.shape[:2]] + [(0, 0)] * (image.ndim - 2)
    even = np.pad(image, odd, mode="edge")
    if even.ndim == 3:
        return np.asarray(cv2.cvtColor(even, cv2.COLOR_RGB2YUV_I420), np.uint8)
    grey = np.round(16 + even * (219 / 255)).astype(np.uint8)
    colour = np.full((even.shape[0] // 2, even.shape[1]), 128, np.uint8)
    return np.concatenate([grey, colour])


def _stream(
    container: av.container.OutputContainer, planes: Image, rate: float, codec: Codec
) -> av.VideoStream:
    lossless = codec.name == "ffv1"
    stream = container.add_stream(
        "ffv1" if lossless else "libx264", rate=Fraction(rate).limit_denominator(1001)
    )
    rows, stream.width = planes.shape
    stream.height = rows if lossless else rows * 2 // 3
    stream.time_base = Fraction(1, _TICKS)
    stream.codec_context.time_base = stream.time_base
    stream.pix_fmt = "gray" if lossless else "yuv420p"
    stream.thread_count = 1
    if not lossless:
        steady = "mbtree=0:weightp=0"  # with these, x264 does not always give the same bytes
        stream.options = {"crf": str(codec.crf), "preset": "medium", "x264-params": steady}
        if codec.name == "h264 intra":
            stream.options = {**stream.options, "g": "1"}
    stream.codec_context.flags |= av.codec.context.Flags.bitexact
    return stream
