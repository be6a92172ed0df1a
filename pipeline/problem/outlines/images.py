"""Reads outlines of the dark part of a binary image, or of the paths in an SVG drawing."""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from pipeline.problem.outlines.drawing_paints import (
    CLIPS,
    check_clips,
    check_paints,
    check_pictures,
    fills_nonzero,
    grey,
    is_filled,
    is_seen,
)
from pipeline.problem.outlines.painted_areas import (
    Painted,
    nonzero_outlines,
    painted_outlines,
    pieces_of,
)
from pipeline.problem.outlines.plane import Outline, extents
from pipeline.runtime import UserError, read_bounded

if TYPE_CHECKING:
    from svgelements import SVG
    from svgelements import Path as SvgPath

DARK, LIGHT = 77, 178
"""Grey levels (of 255) below which a pixel is dark, and above which it is light."""
LARGEST_BLUR = 0.05
"""Share of pixels that may be neither dark nor light: the soft rim of a scanned drawing."""
SPECK = 1e-3
"""Parts of a smaller share of the largest part's area are dust."""
LARGEST_SIDE = 4000  # pixels
LARGEST_FILE = 64 << 20  # bytes
LARGEST_DRAWING = 20_000
"""Elements of a drawing times its copies by `use`, of which none may hold another."""
DEEPEST = 100
"""Levels of groups in one another."""
MOST_NUMBERS = 60_000
"""In all paths of a drawing, each as often as it is copied."""
MOST_POINTS = 20_000
"""Of all outlines: a curve has fewer chords where there are many."""
SEGMENTS = 24  # chords of a curved piece of a path
FARTHEST = 1e9
"""Coordinate of a drawing, in its own unit."""
UNPAINTED = {"marker", "mask", "pattern", "symbol"}
"""Elements of a drawing whose content is not painted where it stands, but where it is used."""


def read_outlines(
    path: Path, *, threshold: float | None = None, invert: bool = False
) -> tuple[Outline, ...]:
    """Reads closed outlines of the shape in a PNG, JPG or SVG, y up, in pixels or the file's unit.

    A point within an odd number of them lies in the shape. A pixel is in it below the `threshold`,
    a grey level from 0 of black to 1 of white; without it, an image must be binary. So is a part of
    a drawing, whose light parts cut those they lie on; fills that overlap are one, and a fill has
    the holes that its `fill-rule` leaves. `invert` takes what is light.

    Raises:
        UserError: no such file, unreadable, not binary, or without a shape.
    """
    try:
        held = read_bounded(path, LARGEST_FILE)
    except OSError as error:
        what = f"the image cannot be read: {error.strerror}"
        raise UserError(what, remedy="give its path as seen from the problem file") from error
    if path.suffix.lower() == ".svg":
        outlines = _of_drawing(path, threshold, invert)
    else:
        outlines = _of_pixels(_dark(held, threshold, invert))
    if not outlines:
        remedy = (
            "draw it dark on a light ground; or say that it is light, `invert: true` (`--invert`),"
            " or below which grey level it is dark, `threshold: 0.5` (`--threshold 0.5`)"
        )
        raise UserError("the image shows no shape", remedy=remedy)
    read = tuple(
        tuple((round(float(x), 6), round(-float(y), 6)) for x, y in points) for points in outlines
    )
    if min(extents(tuple(point for outline in read for point in outline))) == 0.0:
        remedy = "draw it larger, in pixels or millimetres"
        raise UserError("the image's shape has no width or no height", remedy=remedy)
    return read


def _of_pixels(dark: NDArray[np.uint8]) -> list[NDArray[Any]]:
    import cv2

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


def _dark(held: bytes, threshold: float | None, invert: bool) -> NDArray[np.uint8]:
    """Marks the pixels of an image's shape; transparent ones belong to its ground."""
    import cv2

    cv2.utils.logging.setLogLevel(
        cv2.utils.logging.LOG_LEVEL_SILENT
    )  # the error below tells it all
    stored = np.frombuffer(held, np.uint8)
    try:
        pixels = cv2.imdecode(stored, cv2.IMREAD_UNCHANGED)
        if pixels is not None and pixels.shape[2:] != (4,):  # turned by EXIF, but without cover
            pixels = cv2.imdecode(stored, cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
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
        ground = 0.0 if invert else 255.0
        grey = cover * colours[..., : colours.shape[2] - 1].mean(axis=2) + (1 - cover) * ground
    between = float(np.mean((grey >= DARK) & (grey <= LIGHT)))
    if threshold is None and between > LARGEST_BLUR:
        what = f"the image is not binary: {between:.0%} of its pixels are neither dark nor light"
        remedy = (
            "save it as black on white, or give the grey level below which a pixel is in the shape:"
            " `threshold: 0.5` (`--threshold 0.5`; 0.95 takes every colour on white or on nothing)"
        )
        raise UserError(what, remedy=remedy)
    level = (DARK + LIGHT) / 2 if threshold is None else 255 * threshold
    return ((grey >= level) if invert else (grey < level)).astype(np.uint8)


def _of_drawing(path: Path, threshold: float | None, invert: bool) -> list[NDArray[Any]]:
    try:
        _check_depth(path)
        drawing = ElementTree.parse(path).getroot()
        _check_copies(drawing)
        _set_aside(drawing)
        read, paths = _parsed(drawing)
        elements = list(read.elements())
        _check_outlines(elements, paths)
        check_pictures(elements)
        check_paints(paths)
        count = min(SEGMENTS, MOST_POINTS // max(1, sum(map(len, paths))))
        if count < 2:
            raise ValueError(f"it has more than {MOST_POINTS // 2} pieces; simplify it")
        drawn = [pieces_of(each, count) for each in paths]
        if any(not (np.abs(points) < FARTHEST).all() for pieces in drawn for points in pieces):
            raise ValueError(f"it has points further than {FARTHEST:g} from its origin")
        check_clips(read)
        filled = [
            nonzero_outlines(pieces) if fills_nonzero(each) else pieces
            for each, pieces in zip(paths, drawn, strict=True)
        ]
    # an XML parse error is a SyntaxError; a radius or a scale of 1e-300 divides by zero
    except (OSError, ValueError, SyntaxError, ArithmeticError, RecursionError) as error:
        raise UserError(f"not a readable SVG: {error}", remedy="save it as plain SVG") from error
    level = LIGHT if threshold is None else 255 * threshold
    shown = [(grey(each) < level) != invert for each in paths]
    return painted_outlines([*map(Painted, shown, map(is_filled, paths), filled)])


def _parsed(drawing: ElementTree.Element) -> tuple[SVG, list[SvgPath]]:
    """Returns a drawing, and its elements that are seen and have an outline as paths."""
    from svgelements import SVG, Shape
    from svgelements import Path as Curve

    try:
        held = BytesIO(ElementTree.tostring(drawing))
        read = SVG.parse(held, reify=True)
        shapes = (each for each in read.elements() if isinstance(each, Shape))
        return read, [Curve(each) for each in shapes if is_seen(each)]
    except Exception as error:  # whatever a parser of another project meets in a damaged file
        raise ValueError(f"{type(error).__name__}: {error}") from error


def _check_outlines(elements: list[Any], paths: list[SvgPath]) -> None:
    """Refuses text, and lines that enclose nothing."""
    from svgelements import Close, Text

    if any(isinstance(element, Text) for element in elements):
        remedy = "convert text to paths (Inkscape: Path > Object to Path)"
        raise UserError("the drawing holds text, which has no outline", remedy=remedy)
    for path in paths:
        pieces = [piece for piece in path.as_subpaths() if len(piece) > 1]
        if not is_filled(path) and any(
            not isinstance(piece[-1], Close) and piece[0].end != piece[-1].end for piece in pieces
        ):
            remedy = "close them, or convert strokes to paths (Inkscape: Path > Stroke to Path)"
            raise UserError("the drawing holds lines that enclose nothing", remedy=remedy)


def _check_depth(path: Path) -> None:
    """Refuses groups in groups without end, before anything follows them."""
    depth = 0
    for event, element in ElementTree.iterparse(path, ("start", "end")):
        depth += 1 if event == "start" else -1
        if depth > DEEPEST:
            raise ValueError(f"groups are nested deeper than {DEEPEST}")
        if event == "end":
            element.clear()


def _check_copies(drawing: ElementTree.Element) -> None:
    """Refuses copies of copies, of which few lines make more than any memory holds."""
    if drawing.tag.rpartition("}")[2] != "svg":
        raise ValueError("it does not begin with an element svg")
    elements = list(drawing.iter())
    copies = [element for element in elements if _is_copy(element)]
    words = (element.get(key, "") for element in elements for key in ("d", "points"))
    numbers = sum(len(re.findall(r"\d[\d.]*", word)) for word in words)
    many = len(elements) * (1 + len(copies)) > LARGEST_DRAWING
    if many or numbers * (1 + len(copies)) > MOST_NUMBERS:
        raise ValueError("too many paths, or copies of elements (use)")
    named = {element.get("id"): element for element in elements}
    for copy in copies:
        link = next((word for key, word in copy.items() if key.endswith("href")), "")
        shown = named.get(link.removeprefix("#"))
        if shown is not None and any(map(_is_copy, shown.iter())):
            raise ValueError("copies (use) of copies")


def _set_aside(drawing: ElementTree.Element) -> None:
    """Moves to definitions what is not painted where it stands, all clips to the last of them."""
    space = drawing.tag.rpartition("}")[0]
    defs = f"{space}}}defs" if space else "defs"
    clips = ElementTree.Element(defs, id=CLIPS)
    for above in list(drawing.iter()):
        for place, element in enumerate(list(above)):
            name = element.tag.rpartition("}")[2]
            if name == "clipPath":
                clips.append(element)
                above[place] = ElementTree.Element(defs)
            elif name in UNPAINTED:
                above[place] = ElementTree.Element(defs)
                above[place].append(element)
    drawing.append(clips)


def _is_copy(element: ElementTree.Element) -> bool:
    return element.tag.rpartition("}")[2] == "use"
