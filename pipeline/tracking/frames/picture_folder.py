"""Reads frames of a folder of numbered pictures (PNG, TIFF)."""

import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path

from pipeline.runtime import Picture, UserError
from pipeline.tracking.frames.frame import Frame, broken_off, untimed
from pipeline.tracking.frames.picture import brightness, full_scale, page_count, read_levels

_PAGED = {".tif", ".tiff"}
_SUFFIXES = {".png", *_PAGED}


def read_folder(path: Path, start: float, end: float, rate: float | None) -> Iterator[Frame]:
    """Yields the pictures of a time window, s; the first of the folder is at zero.

    Raises:
        UserError: there are none, the first cannot be read, or no rate is given.
        BrokenOffError: a later one cannot be read.
    """
    if rate is None:
        raise untimed(path, "pictures have no times")
    inside = takewhile(lambda frame: frame.time <= end, _pictured(path, rate))
    yield from (frame for frame in inside if start <= frame.time)


def _pictured(path: Path, rate: float) -> Iterator[Frame]:
    count = 0
    try:
        for count, image in enumerate(images(path), start=1):
            yield Frame(count - 1, (count - 1) / rate, image)
    except UserError as error:
        if count == 0:
            raise
        raise broken_off(path, f"{error.file} cannot be read", count, (count - 1) / rate) from error


def pictures(folder: Path) -> list[Path]:
    """Lists the folder's pictures in the order of the numbers in their names.

    Raises:
        UserError: there are none.
    """
    found = _listed(folder)
    if not found:
        remedy = "give a video file, or a folder of numbered .png or .tif files"
        raise UserError("the folder holds no pictures", file=folder, remedy=remedy)
    return sorted(found, key=_numbers)


def has_pictures(folder: Path) -> bool:
    """Tells whether a folder holds pictures."""
    return bool(_listed(folder))


def _listed(folder: Path) -> list[Path]:
    return [
        path
        for path in folder.iterdir()
        if path.suffix.lower() in _SUFFIXES and not path.name.startswith(".")
    ]


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
