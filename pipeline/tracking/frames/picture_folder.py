"""Reads frames of a folder of numbered pictures (PNG, TIFF)."""

import re
import shlex
import sys
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path

import numpy as np

from pipeline.runtime import Picture, UserError
from pipeline.tracking.frames.frame import Frame, missing_times, truncated_video
from pipeline.tracking.frames.picture import brightness, full_scale, page_count, read_levels

_PAGED = {".tif", ".tiff"}
_SUFFIXES = {".png", *_PAGED}


def read_folder(path: Path, start: float, end: float, rate: float | None) -> Iterator[Frame]:
    """Yields the pictures of a time window, s; the first of the folder is at zero.

    Numbers that are missing among their names are frames that are missing.

    Raises:
        UserError: there are none, the first cannot be read, or no rate is given.
        TruncatedVideoError: a later one cannot be read.
    """
    if rate is None:
        raise missing_times(path, "pictures have no times")
    inside = takewhile(lambda frame: frame.time <= end, _frames_of(path, pictures(path), rate))
    yield from (frame for frame in inside if start <= frame.time)


def _frames_of(path: Path, found: list[Path], rate: float) -> Iterator[Frame]:
    count, times = 0, [place / rate for place in frame_indices(found)]
    try:
        for count, image in enumerate(images(found), start=1):
            yield Frame(count - 1, times[count - 1], image)
    except UserError as error:
        if count == 0:
            raise
        raise truncated_video(
            path, f"{error.file} cannot be read", count, times[count - 1]
        ) from error


def frame_indices(found: list[Path]) -> list[int]:
    """Numbers a folder's pictures, from zero, by the counter in their names.

    Its smallest step is that of a frame; where names differ in more than a counter, or steps are
    no multiples of one, none is taken to be missing.
    """
    plain = list(range(len(found)))
    if len({_name_pattern(path) for path in found}) > 1:
        return plain
    numbers = np.array([_numbers(path)[0] for path in found])
    counters = np.flatnonzero((numbers != numbers[0]).any(axis=0))
    if len(counters) != 1:
        return plain
    counted = numbers[:, counters[0]] - numbers[0, counters[0]]
    step = np.diff(counted).min()
    if step < 1 or (counted % step).any():
        return plain
    return [int(place) for place in counted // step]


def pictures(folder: Path) -> list[Path]:
    """Lists the folder's pictures in the order of the numbers in their names.

    Raises:
        UserError: there are none.
    """
    found = _list_pictures(folder)
    if not found:
        remedy = "give a video file, or a folder of numbered .png or .tif files"
        raise UserError("the folder holds no pictures", file=folder, remedy=remedy)
    return sorted(found, key=_numbers)


def has_pictures(folder: Path) -> bool:
    """Tests whether a folder holds pictures."""
    return bool(_list_pictures(folder))


def _list_pictures(folder: Path) -> list[Path]:
    inside = folder.iterdir() if folder.is_dir() else ()
    return [
        path
        for path in inside
        if path.suffix.lower() in _SUFFIXES and not path.name.startswith(".")
    ]


def _numbers(path: Path) -> tuple[list[int], str]:
    return [int(digits) for digits in re.findall(r"\d+", path.stem)], path.name


def _name_pattern(path: Path) -> str:
    """Returns a picture's name without its numbers."""
    return re.sub(r"\d+", "0", path.stem)


def images(found: list[Path]) -> Iterator[Picture]:
    """Reads the brightness of a folder's pictures, one after the other.

    The first, the last and the one between tell how many levels the camera has.

    Raises:
        UserError: one cannot be read, or holds several.
    """
    some = (read_levels(found[place]) for place in (0, len(found) // 2, -1))
    top = full_scale([levels for levels in some if levels is not None])
    for path in found:
        if (levels := read_levels(path)) is None:
            raise UserError("not a readable picture", file=path, remedy="write the file again")
        if path.suffix.lower() in _PAGED and (count := page_count(path)) > 1:
            what = f"there are {count} pictures in one file"
            remedy = f"write each to a file, then take {path.name} away; in its folder run: "
            remedy += _split_pages(path)
            raise UserError(what, file=path, key="video", remedy=remedy)
        yield brightness(levels, top)


def _split_pages(path: Path) -> str:
    """Returns the command that writes each picture of a file to one of its own, beside it."""
    code = (
        "import cv2, sys; [cv2.imwrite(f'{sys.argv[2]}_{k:05}.tif', page) for k, page in"
        " enumerate(cv2.imreadmulti(sys.argv[1], flags=cv2.IMREAD_UNCHANGED)[1])]"
    )
    python, *names = map(shlex.quote, (sys.executable, path.name, path.stem))
    return f'{python} -c "{code}" {" ".join(names)}'
