"""Reads the brightness of pictures, of whatever depth, and writes drawings over them."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from PIL.Image import fromarray
from PIL.PngImagePlugin import PngInfo

from pipeline.runtime import Picture, UserError, begins_with, write_atomically
from sim.core import Image

WHITE = 255.0
"""Brightness of white."""

_FULL_SCALES = (1023.0, 4095.0, 16383.0, 65535.0)
"""Greatest levels of cameras of 10 to 16 bit, whose pictures hold them in 16 bit as they are."""
_OVERSHOOT = 2.0
"""Greatest level where white is one: what sharpens or resamples pictures goes a little beyond."""

_READ_FLAGS = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH

_KEYWORD, _DRAWN = "Software", "metacloak: python -m pipeline track"
"""Of a chunk of text, by which drawings are known."""
_QUICK = 1  # of 9: a third of the time, and a third more bytes
is_own_drawing = begins_with(f"{_KEYWORD}\0{_DRAWN}")


def read_levels(path: Path) -> np.ndarray | None:
    """Reads the grey levels (rows, columns) that a picture's file holds; None if it cannot."""
    try:
        levels = cv2.imread(str(path), _READ_FLAGS)
    except cv2.error:  # too many pixels, among others
        return None
    return None if levels is None else np.asarray(levels)


def page_count(path: Path) -> int:
    """Counts the pictures in a TIFF that can be read; previews of another size are none."""
    if (count := cv2.imcount(str(path), _READ_FLAGS)) < 2:
        return 1
    pages = cv2.imreadmulti(str(path), 0, 2, flags=_READ_FLAGS)[1]
    return count if len({page.shape for page in pages}) == 1 else 1


def full_scale(pictures: Sequence[np.ndarray]) -> float:
    """Finds the level of white of the camera that took the pictures; see ``brightness``.

    One of 16 bit that used less than a quarter of its range is told as one of less, whose white
    its brightest pixel does not reach either. So is one of signed or real numbers, whose white
    may be one; beyond 16 bit, the brightest pixel is white.
    """
    kinds = {levels.dtype for levels in pictures}
    if kinds <= {np.dtype(np.uint8)}:
        return WHITE
    most = max(float(levels[np.isfinite(levels)].max(initial=0)) for levels in pictures)
    if all(kind.kind == "u" for kind in kinds):
        return next(top for top in _FULL_SCALES if top >= most)
    if most < _OVERSHOOT:
        return 1.0
    return next((top for top in (WHITE, *_FULL_SCALES) if top >= most), most)


def brightness(levels: np.ndarray, top: float) -> Picture:
    """Computes brightness from 0 to 255, (rows, columns): 8 bit as they are, more as fractions.

    `top` is the level of white; what is brighter counts as white, what is no number as black.
    """
    if levels.dtype == np.uint8:
        return levels
    known = levels if levels.dtype.kind == "u" else np.nan_to_num(levels, posinf=top)
    return np.asarray(np.clip(known * (WHITE / top), 0.0, WHITE), np.float32)


def read_pictures(*paths: Path) -> list[Image]:
    """Reads pictures of one camera in grey levels of 8 bit (rows, columns), on one scale.

    Raises:
        UserError: one is none.
    """
    found = []
    for path in paths:
        if (levels := read_levels(path)) is None:
            remedy = "name a PNG, TIFF or JPEG that is there"
            raise UserError("no picture that can be read", file=path, remedy=remedy)
        found.append(levels)
    top = full_scale(found)
    return [np.asarray(np.round(brightness(levels, top)), np.uint8) for levels in found]


def read_picture(path: Path) -> Image:
    """Reads one picture; see ``read_pictures``."""
    return read_pictures(path)[0]


def write_drawing(picture: np.ndarray, path: Path) -> None:
    """Writes a picture (rows, columns, 3) of blue, green and red as a PNG with a text chunk (tEXt).

    `is_own_drawing` knows it by that.
    """
    told = PngInfo()
    told.add_text(_KEYWORD, _DRAWN)
    drawn = fromarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
    with write_atomically(path) as aside:
        drawn.save(aside, "PNG", pnginfo=told, compress_level=_QUICK)
