"""Turns frames, as they are decoded, into brightness as players show it."""

from typing import NamedTuple, cast

import av
import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.frames.picture import WHITE, brightness
from sim.core import Floats

_LUMA_FORMATS = {
    "gray",
    "yuv420p",
    "yuvj420p",
    "yuv422p",
    "yuvj422p",
    "yuv444p",
    "yuvj444p",
    "nv12",
}
"""Formats whose first plane is the brightness in 8 bit, as it is."""

_WHITE_16_BIT = 65535.0
"""White of the frames that FFmpeg gives in 16 bit, however many the file has."""
_LUMA = np.array([0.299, 0.587, 0.114])
_SPREAD_RATIO = 2.5
"""Colours that spread so many times more than luma are what tells units from the board."""
_STRIDE, _RANGE = 4, 200.0


class BrightnessConverter:
    """Converts frames to brightness: luma, or the principal colour if that is far stronger."""

    def __init__(self) -> None:
        self._axis: Floats | None = None
        self._has_axis = False

    def __call__(self, frame: av.VideoFrame) -> Picture:
        """Returns (rows, columns) brightness, from 0 to 255."""
        if not self._has_axis:
            self._has_axis, self._axis = True, _principal_colour(frame)
        if self._axis is None:
            return _brightness(frame)
        return _project(frame, self._axis)


def _principal_colour(frame: av.VideoFrame) -> Floats | None:
    """Returns weights (3,) of red, green and blue with an offset last, or nothing for luma's.

    Luma is kept unless the colours' main direction spreads them far more.
    """
    if len(frame.format.components) < 3:
        return None
    colour = frame.to_ndarray(format="rgb24")[::_STRIDE, ::_STRIDE].reshape(-1, 3).astype(float)
    spread, axes = np.linalg.eigh(np.cov(colour.T))
    axis = axes[:, -1] * np.sign(axes[np.abs(axes[:, -1]).argmax(), -1])
    if np.sqrt(spread[-1]) < _SPREAD_RATIO * float((colour @ _LUMA).std()):
        return None
    low, high = np.percentile(colour @ axis, [1, 99])
    gain = _RANGE / max(float(high - low), 1e-9)
    return np.append(axis * gain, 0.5 * (WHITE - gain * (high + low)))


def _project(frame: av.VideoFrame, axis: Floats) -> Picture:
    deep = max(part.bits for part in frame.format.components) > 8
    colour = frame.to_ndarray(format="rgb48le" if deep else "rgb24").astype(np.float32)
    weights = (axis[:3] / (257.0 if deep else 1.0)).astype(np.float32)
    return np.asarray(np.clip(colour @ weights + np.float32(axis[3]), 0, WHITE), np.float32)


def _brightness(frame: av.VideoFrame) -> Picture:
    if max(part.bits for part in frame.format.components) > 8:
        return brightness(frame.to_ndarray(format="gray16le"), _WHITE_16_BIT)
    if frame.format.name not in _LUMA_FORMATS:
        return np.asarray(frame.to_ndarray(format="gray"), np.uint8)
    plane = frame.planes[0]
    rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, abs(plane.line_size))
    upward = plane.line_size < 0  # in files that hold the last row first
    return np.ascontiguousarray(rows[:: -1 if upward else 1, : plane.width])


class Orientation(NamedTuple):
    """Holds the orientation in which players show a frame, as the file states it.

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


def orientation(frame: av.VideoFrame) -> Orientation:
    """Reads the matrix by which pixels (x, y, 1), y down, go to their places, if there is one."""
    matrix = frame.side_data.get("DISPLAYMATRIX")
    if matrix is None:
        return Orientation()
    (a, b), (c, d) = np.frombuffer(cast("bytes", matrix), np.int32).reshape(3, 3)[:2, :2].tolist()
    transposed = abs(b) + abs(c) > abs(a) + abs(d)
    x, y = (c, b) if transposed else (a, d)
    return Orientation(transposed, rows_reversed=y < 0, columns_reversed=x < 0)
