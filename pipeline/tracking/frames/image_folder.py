"""Frames from a folder of numbered pictures (PNG, TIFF), in place of a video."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from pipeline.runtime import Picture, UserError

_SUFFIXES = {".png", ".tif", ".tiff"}
_WHITE = 255.0


def pictures(folder: Path) -> list[Path]:
    """The folder's pictures in the order of the numbers in their names.

    Raises:
        UserError: there are none.
    """
    found = [path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES]
    if not found:
        remedy = "give a video file, or a folder of numbered .png or .tif files"
        raise UserError("the folder holds no pictures", file=folder, remedy=remedy)
    return sorted(found, key=_numbers)


def _numbers(path: Path) -> tuple[list[int], str]:
    return [int(digits) for digits in re.findall(r"\d+", path.stem)], path.name


def images(folder: Path) -> Iterator[Picture]:
    """Their brightness, one after the other.

    Raises:
        UserError: one cannot be read.
    """
    for path in pictures(folder):
        if (image := _read(path)) is None:
            raise UserError("not a readable picture", file=path, remedy="write the file again")
        yield image


def _read(path: Path) -> Picture | None:
    try:
        values = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH)
    except cv2.error:  # too many pixels, among others
        return None
    return None if values is None else brightness(np.asarray(values))


def brightness(values: np.ndarray) -> Picture:
    """Brightness from 0 to 255, (rows, columns): 8 bit as they are, finer steps as fractions."""
    if values.dtype == np.uint8:
        return values
    top = np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1.0
    return np.asarray(values * (_WHITE / top), np.float32)
