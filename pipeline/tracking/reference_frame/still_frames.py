"""Averages frames in which a specimen rests; measures noise, detects a start in motion."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.frames import Frame, TruncatedVideoError
from sim.core import Floats, Singles

_MOST, _MEMORY = 64, 1 << 27
"""Frames, and pixels of all, that are averaged at most."""
_BLOCK = 8
_NOISE_RATIO, _LARGEST_RATIO = 1.3, 7.0
"""Mean square, and largest, of blocks' changes that noise alone makes, in standard deviations."""
_ROUNDING_NOISE = 0.41
"""Standard deviation of the difference of two frames that are rounded to whole levels."""
_LAPLACE = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32) / 6
"""Passes noise with its standard deviation, but no plane (Immerkaer, CVIU 64 (1996) 300)."""
_NORMAL = 0.6745
_SPAN = 4
"""Frames, about, over which motion shows at the start."""
_STEADY_SHARE = 0.35
"""Part of the way that lies in the first half of them, at least, of what moves already: half of it
at a steady speed, a quarter from rest, all of it where noise alone is seen."""
_LEAST_TRAVEL = 0.1
"""Least way in them, px: a codec moves units by up to 0.06 px that rest."""
_TOLERANCE, _LARGEST_OFFSET = 0.05, 0.3
"""Root mean square of what units are off the design, mm, that motion may add to, and that is more
than the tolerance of a specimen."""
_FEWEST = 6


class StillFrames(NamedTuple):
    """Holds the beginning of a video.

    Attributes:
        frames: all of the video, the averaged ones again.
        image: mean of those in which nothing moves; the first frame alone, if the next differs.
        averaged: number of them; zero in a video without frames.
        noise: standard deviation of the brightness in a single one.
    """

    frames: Iterator[Frame]
    image: Picture
    averaged: int
    noise: float


def average_at_rest(frames: Iterator[Frame]) -> StillFrames:
    """Averages the first frames as long as only noise tells them apart."""
    first = next(frames, None)
    if first is None:
        return StillFrames(iter(()), np.zeros((0, 0), np.float32), 0, 0.0)
    kept, total = [first], np.asarray(first.image, np.float32).copy()
    most = min(_MOST, max(1, _MEMORY // first.image.size))
    ahead: Frame | None = None
    error: TruncatedVideoError | KeyboardInterrupt | None = None
    noises: list[float] = []
    try:
        while len(kept) < most and (ahead := next(frames, None)) is not None:
            noise = _noise_unless_moved(
                np.asarray(total / len(kept), np.float32), ahead.image, len(kept)
            )
            if noise is None:
                break
            noises.append(noise)
            kept.append(ahead)
            total += ahead.image
            ahead = None
    except (TruncatedVideoError, KeyboardInterrupt) as broken:
        error = broken
    count = len(kept)
    image: Picture = first.image if count == 1 else np.asarray(total / count, np.float32)
    noise = float(np.median(noises)) if noises else image_noise(first.image)
    again = itertools.chain(kept, () if ahead is None else (ahead,), _remaining(frames, error))
    return StillFrames(again, image, count, noise)


def _remaining(
    frames: Iterator[Frame], error: TruncatedVideoError | KeyboardInterrupt | None
) -> Iterator[Frame]:
    if error is not None:
        raise error
    yield from frames


def image_noise(image: Picture) -> float:
    """Measures the standard deviation of noise in a picture that is smooth nearly everywhere."""
    rough = cv2.filter2D(image.astype(np.float32), -1, _LAPLACE)
    return float(np.median(np.abs(rough))) / _NORMAL


def _noise_unless_moved(mean: Singles, image: Picture, count: int) -> float | None:
    """Returns the noise of a frame that shows what the mean of some does; nothing if it moved."""
    if mean.shape != image.shape:
        return None
    shown = image.astype(np.float32)
    gain = float(np.vdot(shown, mean)) / max(float(np.vdot(mean, mean)), 1e-9)  # lamps flicker
    change = np.asarray(shown - np.float32(gain) * mean, np.float32)
    spread = max(image_noise(change), _ROUNDING_NOISE)
    rows, columns = (size // _BLOCK for size in image.shape)
    blocks = cv2.resize(
        change[: rows * _BLOCK, : columns * _BLOCK], (columns, rows), interpolation=cv2.INTER_AREA
    )
    blocks = np.asarray(blocks, np.float64) * (_BLOCK / spread)
    if float(np.mean(blocks**2)) > _NOISE_RATIO or float(np.abs(blocks).max()) > _LARGEST_RATIO:
        return None
    return spread / float(np.sqrt(1 + 1 / count))


def start_warning(motion: Floats, centre: Floats, residual: Floats, pixel: float) -> str:
    """Warns, in words, of a first frame in motion or off the design; empty where all is well.

    Where the specimen rests it is off the design by its tolerance alone, which motion adds to.

    Args:
        motion: (frames, units, 2) displacements, mm, NaN where missing.
        centre: (units, 2) of the design, mm.
        residual: (units, 2) where the first frame shows units less where the design has them, px.
        pixel: its size, mm.
    """
    known = residual[np.isfinite(residual)]
    off = float(np.sqrt(np.mean(known**2))) * pixel if known.size else 0.0
    moves = off > _TOLERANCE and _is_moving(motion, centre, _LEAST_TRAVEL * pixel)
    if not moves and off <= _LARGEST_OFFSET:
        return ""
    why = "the specimen moves from the first frame on" if moves else "check the design, too"
    return (
        f"units of the first frame are {off:.2g} mm off the design: scale and motions may be wrong;"
        f" start the window where the specimen rests ({why})"
    )


def _is_moving(motion: Floats, centre: Floats, least: float) -> bool:
    """Detects motion (frames, units, 2) in the first frames, but for the camera's."""
    half = min(_SPAN, len(motion) - 1) // 2
    if half < 1:
        return False
    change = motion[[half, 2 * half]] - motion[0]
    known = np.isfinite(change).all(axis=(0, 2))
    if known.sum() < _FEWEST:
        return False
    # an affine motion may be a hand-held camera's, and leaves nothing off the design
    basis = np.linalg.qr(np.column_stack([np.ones(known.sum()), centre[known]]))[0]
    rest = change[:, known] - basis @ (basis.T @ change[:, known])
    early, late = np.sqrt(np.mean(rest**2, axis=(1, 2)))
    return bool(late > least and _STEADY_SHARE * late < early < late)
