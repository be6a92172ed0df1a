"""Writes frames as a video: the same frames give the same bytes."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av

from pipeline.lab.setup import Codec
from pipeline.tracking.arrays import Image
from pipeline.whole import whole

_TICKS = 90000  # per second: a usual clock of containers


def encode(
    path: Path, images: Iterable[Image], rate: float, codec: Codec, labels: dict[str, str]
) -> None:
    """Writes the video, whole or not at all.

    Args:
        path: the file; its name should have one of the codec's `suffixes`.
        images: grey, (rows, columns) or colour, (rows, columns, 3).
        rate: frames per second.
        codec: how to store them.
        labels: metadata of the file: title, comment.
    """
    with (
        whole(path) as aside,
        av.open(str(aside), "w", options={"fflags": "+bitexact"}) as container,
    ):
        container.metadata.update(labels)
        _write(container, images, rate, codec)


def _write(
    container: av.container.OutputContainer, images: Iterable[Image], rate: float, codec: Codec
) -> None:
    stream = None
    for index, image in enumerate(images):
        if stream is None:
            stream = _stream(container, image, rate, codec)
        colour = image.ndim == 3
        frame = av.VideoFrame.from_ndarray(image, format="rgb24" if colour else "gray")
        frame.pts, frame.time_base = round(index * _TICKS / rate), Fraction(1, _TICKS)
        container.mux(stream.encode(frame))
    if stream is not None:
        container.mux(stream.encode(None))


def _stream(
    container: av.container.OutputContainer, image: Image, rate: float, codec: Codec
) -> av.VideoStream:
    lossless = codec.name == "ffv1"
    stream = container.add_stream(
        "ffv1" if lossless else "libx264", rate=Fraction(rate).limit_denominator(1001)
    )
    stream.height, stream.width = image.shape[:2]
    stream.time_base = Fraction(1, _TICKS)
    stream.codec_context.time_base = stream.time_base
    stream.pix_fmt = "gray" if lossless and image.ndim == 2 else "yuv420p"
    stream.thread_count = 1
    if not lossless:
        stream.options = {"crf": str(codec.crf), "preset": "medium"}
        if codec.name == "h264 intra":
            stream.options = {**stream.options, "g": "1"}
    stream.codec_context.flags |= av.codec.context.Flags.bitexact
    return stream
