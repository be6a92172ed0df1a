"""Reads outlines of the dark part of a binary image, or of the paths in an SVG drawing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from pipeline.problem.outlines.plane import Outline
from pipeline.runtime import UserError, read_bounded

if TYPE_CHECKING:
    from svgelements import Path as SvgPath

DARK, LIGHT = 77, 178
"""Grey levels (of 255) below which a pixel is dark, and above which it is light."""
LARGEST_BLUR = 0.05
"""Share of pixels that may be neither dark nor light: the soft rim of a scanned drawing."""
SPECK = 1e-3
"""Parts of a smaller share of the largest part's area are dust."""
LARGEST_SIDE = 4000  # pixels
LARGEST_FILE = 64 << 20  # bytes
LARGEST_DRAWING = 1_000_000
"""Elements of a drawing times its copies by `use`, of which none may hold another."""
SEGMENTS = 24  # chords of a curved piece of a path


def read_outlines(path: Path) -> tuple[Outline, ...]:
    """Reads closed outlines of an image's shape, y up, in pixels or the drawing's own unit.

    A point within an odd number of them lies in the shape.

    Raises:
        UserError: no such file, unreadable, not binary, or without a shape.
    """
    try:
        held = read_bounded(path, LARGEST_FILE)
    except OSError as error:
        what = f"the image cannot be read: {error.strerror}"
        raise UserError(what, remedy="give its path as seen from the problem file") from error
    outlines = _of_drawing(path) if path.suffix.lower() == ".svg" else _of_pixels(held)
    if not outlines:
        raise UserError("the image shows no shape", remedy="draw the void dark on a light ground")
    return tuple(
        tuple((round(float(x), 6), round(-float(y), 6)) for x, y in points) for points in outlines
    )


def _of_pixels(held: bytes) -> list[NDArray[Any]]:
    import cv2

    dark = (_grey(held) < (DARK + LIGHT) / 2).astype(np.uint8)
    padded = np.pad(dark, 1)
    found, _ = cv2.findContours(padded, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    areas = [cv2.contourArea(contour) for contour in found]
    whole = [
        contour
        for contour, area in zip(found, areas, strict=True)
        if area > 0.0 and area >= SPECK * max(areas)
    ]
    smooth = (cv2.approxPolyDP(contour, 0.7, closed=True)[:, 0] for contour in whole)
    return [points - 1.0 for points in smooth if len(points) > 2]


def _grey(held: bytes) -> NDArray[np.uint8]:
    """Computes grey levels of a binary image; transparent pixels are white.

    Raises:
        UserError: unreadable, too large or not binary.
    """
    import cv2

    cv2.utils.logging.setLogLevel(
        cv2.utils.logging.LOG_LEVEL_SILENT
    )  # the error below tells it all
    try:
        pixels = cv2.imdecode(np.frombuffer(held, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:  # empty, or too many pixels, among others
        pixels = None
    if pixels is None or pixels.dtype != np.uint8:
        raise UserError("not a readable image", remedy="give a PNG or JPG of 8 bits, or an SVG")
    if max(pixels.shape[:2]) > LARGEST_SIDE:
        size = f"{pixels.shape[1]} x {pixels.shape[0]}"
        raise UserError(
            f"{size} pixels are too many", remedy=f"keep it within {LARGEST_SIDE} a side"
        )
    colours = pixels.reshape(*pixels.shape[:2], -1).astype(float)
    grey = colours[..., :3].mean(axis=2)
    if colours.shape[2] in (2, 4):
        cover = colours[..., -1] / 255
        grey = cover * colours[..., : colours.shape[2] - 1].mean(axis=2) + (1 - cover) * 255
    between = float(np.mean((grey >= DARK) & (grey <= LIGHT)))
    if between > LARGEST_BLUR:
        what = f"the image is not binary: {between:.0%} of its pixels are neither dark nor light"
        raise UserError(what, remedy="save it as black on white, without shades")
    return np.round(grey).astype(np.uint8)


def _of_drawing(path: Path) -> list[NDArray[Any]]:
    from svgelements import SVG, Shape
    from svgelements import Path as Curve

    try:
        _check_copies(ElementTree.parse(path).getroot())
        drawing = SVG.parse(str(path), reify=True)
    except (OSError, ValueError, SyntaxError) as error:  # an XML parse error is a SyntaxError
        raise UserError(f"not a readable SVG: {error}", remedy="save it as plain SVG") from error
    shapes = (Curve(element) for element in drawing.elements() if isinstance(element, Shape))
    pieces = (_chords(Curve(piece)) for shape in shapes for piece in shape.as_subpaths())
    return [points for points in pieces if len(points) > 2]


def _check_copies(drawing: ElementTree.Element) -> None:
    """Refuses copies of copies, of which few lines make more than any memory holds.

    Raises:
        ValueError: there are some, or too many copies.
    """
    elements = list(drawing.iter())
    copies = [element for element in elements if _is_copy(element)]
    if len(elements) * (1 + len(copies)) > LARGEST_DRAWING:
        raise ValueError("too many copies of elements (use)")
    named = {element.get("id"): element for element in elements}
    for copy in copies:
        link = next((word for key, word in copy.items() if key.endswith("href")), "")
        shown = named.get(link.removeprefix("#"))
        if shown is not None and any(map(_is_copy, shown.iter())):
            raise ValueError("copies (use) of copies")


def _is_copy(element: ElementTree.Element) -> bool:
    return element.tag.rpartition("}")[2] == "use"


def _chords(piece: SvgPath) -> NDArray[Any]:
    from svgelements import Close, Line, Move

    points = []
    for segment in piece:
        if isinstance(segment, Move) or segment.end is None:
            continue
        count = 1 if isinstance(segment, Line | Close) else SEGMENTS
        points += [segment.point(k / count) for k in range(1, count + 1)]
    places = [(float(point.x), float(point.y)) for point in points]
    before = places[-1:] + places[:-1]
    kept = [here for here, last in zip(places, before, strict=True) if here != last]
    return np.array(kept).reshape(-1, 2)
