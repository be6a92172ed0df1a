"""Draws the frames of a movie: every structure true to scale, coloured by what its figure shows."""

from collections.abc import Iterator

import cv2
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.base import style
from reports.panels import COLOUR_MAPS, Animation, ColourField, scalar
from reports.products.movie.layout import (
    DPI,
    HEIGHT,
    WIDTH,
    MovieCell,
    MovieLayout,
    background,
    layout,
    rendered,
)
from reports.study import CLAMPED, RigidUnits, deformed
from sim.core import Floats, Image

RATE = 25.0
"""Frames per second."""
_FINER = 2  # drawn in more pixels than are shown, for thin lines
_SHIFT = 4  # bits behind the point of cv2's coordinates
_INK, _GREY, _PALE = (
    tuple(round(255 * part) for part in to_rgb(colour))
    for colour in (style.INTACT, style.GREY, style.PALE)
)
_CLOCK = (260, 40)


def images(reel: Animation, title: str, note: str) -> Iterator[Image]:
    """Yields the frames (rows, columns, 3), at the first of the reel's speeds."""
    placed = layout(reel)
    still = background(reel, placed, title, note)
    large = still.repeat(_FINER, axis=0).repeat(_FINER, axis=1)
    for at in instants(reel):
        fine = large.copy()
        for cell in placed.cells:
            _draw(fine, reel, placed, cell, at)
        small = cv2.resize(fine, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
        image = np.asarray(small, np.uint8)
        wide, high = _CLOCK
        image[8 : 8 + high, WIDTH - wide - 8 : WIDTH - 8] = _clock(reel, at)
        yield image


def instants(reel: Animation) -> Floats:
    """Tells where along the axis the frames are."""
    first, last = float(reel.axis.values[0]), float(reel.axis.values[-1])
    seconds = (last - first) / next(iter(reel.axis.speeds.values()))
    return np.linspace(first, last, max(2, round(seconds * RATE)))


def _clock(reel: Animation, at: float) -> Image:
    wide, high = _CLOCK
    figure = Figure(figsize=(wide / DPI, high / DPI), dpi=DPI)
    words = f"${reel.axis.name}$ = {at:.{reel.axis.digits}f} {reel.axis.unit}"
    with style.styled():
        figure.text(0.98, 0.8, words, ha="right", va="top", fontsize=style.PANEL)
        return rendered(figure)


def _draw(image: Image, reel: Animation, placed: MovieLayout, cell: MovieCell, at: float) -> None:
    structure, motion = cell.clip.structure, _motion(cell, reel.axis.values, at)
    origin = placed.origin(cell)

    def pixels(points: Floats) -> NDArray[np.int32]:
        flipped = (points - placed.corner) * [1.0, -1.0] * placed.scale + origin
        return np.rint(flipped * (_FINER << _SHIFT)).astype(np.int32)

    for x, y in structure.centroid[structure.support == CLAMPED]:
        half = reel.pad / 2
        box = np.array([[x - half, y - half], [x + half, y + half]])
        (left, low), (right, high) = pixels(box) >> _SHIFT
        cv2.rectangle(image, (int(left), int(high)), (int(right), int(low)), _PALE, cv2.FILLED)
    corners = deformed(structure, motion)
    ends = corners[structure.ligament_unit, structure.ligament_vertex]
    cv2.polylines(image, list(pixels(ends)), False, _GREY, 1, cv2.LINE_AA, _SHIFT)
    _units(image, structure, pixels(np.nan_to_num(corners)), _colours(reel.fields[0], motion))


def _units(
    image: Image, structure: RigidUnits, corners: NDArray[np.int32], colours: NDArray[np.uint8]
) -> None:
    there = np.isfinite(structure.vertices[..., 0])
    for unit in np.flatnonzero(structure.present):
        polygon = corners[unit, there[unit]]
        colour = tuple(int(part) for part in colours[unit])
        cv2.fillPoly(image, [polygon], colour, cv2.LINE_AA, _SHIFT)
        cv2.polylines(image, [polygon], True, _INK, 1, cv2.LINE_AA, _SHIFT)


def _motion(cell: MovieCell, samples: Floats, at: float) -> Floats:
    """Returns displacement (n_units, 3) between two samples; NaN where it is not known."""
    motion = cell.clip.motion[cell.case]
    place = float(np.interp(at, samples, np.arange(len(samples))))
    low = min(int(place), len(samples) - 2)
    return motion[low] + (place - low) * (motion[low + 1] - motion[low])


def _colours(field: ColourField, motion: Floats) -> NDArray[np.uint8]:
    """Returns colours (n_units, 3); white where nothing is known."""
    low, high = field.limits
    values = scalar(field, motion)
    rgba = COLOUR_MAPS[field.colours](np.clip((values - low) / (high - low), 0.0, 1.0))
    rgba[np.isnan(values)] = 1.0
    return np.rint(255 * rgba[:, :3]).astype(np.uint8)
