"""Tells how the elements of a drawing are painted, and refuses what their outlines do not tell."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from pipeline.problem.outlines.painted_areas import filled_area, nonzero_outlines, pieces_of
from pipeline.runtime import UserError

if TYPE_CHECKING:
    from shapely import Geometry
    from svgelements import SVG, ClipPath, Shape, SVGElement
    from svgelements import Path as SvgPath

CLIPS = "clips of the drawing"
"""Name of the definitions that hold all clips, and of which the frame is theirs."""
_CHORDS = 24  # of a curved piece of a path
_LOST = 1e-3
"""Share of a shape's area that a clip may cut off: the chords of curves do."""


def is_seen(shape: Shape) -> bool:
    """Tells a shape that has a fill or a stroke, and is not wholly transparent."""
    if _is_hidden(shape):
        return False
    return is_filled(shape) or (shape.stroke_width != 0.0 and _paints(shape, "stroke"))


def is_filled(shape: Shape) -> bool:
    """Tells a shape with a fill, be it light or dark."""
    return _paints(shape, "fill")


def fills_nonzero(shape: Shape) -> bool:
    """Tells a fill of all that its outline winds round, whichever way and how often."""
    return is_filled(shape) and not _is_even_odd(shape, "fill-rule")


def grey(path: SvgPath) -> float:
    """Returns the grey level, of 255, of a path's fill, or else of its stroke, black without."""
    for kind in ("fill", "stroke"):
        if _paints(path, kind):
            paint = getattr(path, kind)
            return float((paint.red + paint.green + paint.blue) / 3)
    return 0.0


def check_paints(paths: list[SvgPath]) -> None:
    """Refuses gradients and patterns, which are neither dark nor light.

    Raises:
        UserError: a path is painted with one.
    """
    for path in paths:
        kind = "fill" if is_filled(path) else "stroke"
        if str(path.values.get(kind)).strip().startswith("url("):
            remedy = "give it one colour (Inkscape: Object > Fill and Stroke > Flat color)"
            raise UserError("the drawing is painted with a gradient or a pattern", remedy=remedy)


def check_pictures(elements: list[Any]) -> None:
    """Refuses pictures of pixels in a drawing, whose shapes are no paths.

    Raises:
        UserError: there is one, and it is seen.
    """
    from svgelements import Image

    if any(isinstance(each, Image) and not _is_hidden(each) for each in elements):
        remedy = "give that picture as PNG or JPG, or trace it (Inkscape: Path > Trace Bitmap)"
        raise UserError("the drawing holds a picture of pixels", remedy=remedy)


def check_clips(drawing: SVG) -> None:
    """Refuses masks, and clips that cut what is seen.

    Raises:
        UserError: one cuts, or may.
    """
    from svgelements import Path as Curve

    for cut in _cuts(drawing, ()):
        shape = Curve(cut.shape)
        if shape.values.get("mask", "none") != "none":
            what = "the drawing holds a mask"
        elif any(_cuts_off(drawing, shape, *clip) for clip in cut.clips):
            what = "the drawing holds a clip that cuts what is seen"
        else:
            continue
        remedy = "apply it to the path (Inkscape: release it, then Path > Intersection)"
        raise UserError(what, remedy=remedy)


class _Cut(NamedTuple):
    """Holds a seen shape, and the clips of it and of the groups that it is in."""

    shape: Shape
    clips: tuple[tuple[str, str], ...]
    """The name of each, and the transform of what it clips."""


def _cuts(element: SVGElement, clips: tuple[tuple[str, str], ...]) -> Iterator[_Cut]:
    """Yields the seen shapes in an element, with the clips round them."""
    from svgelements import Group, Shape, Use

    own = element.values.get("clip-path") or "none"
    if own != "none":
        clips = (*clips, (own, element.values.get("transform") or ""))
    if isinstance(element, Shape):
        if is_seen(element):
            yield _Cut(element, clips)
    elif isinstance(element, Group | Use):
        for each in element:
            yield from _cuts(each, clips)


def _cuts_off(drawing: SVG, shape: SvgPath, name: str, frame: str) -> bool:
    """Tells a clip that leaves less than the whole of a shape, or of which that is not known."""
    from svgelements import ClipPath

    named = re.fullmatch(r"url\(\s*[\"']?#(.+?)[\"']?\s*\)", name)
    if named is None:  # a circle or an inset of the box around it
        return True
    clip = drawing.objects.get(named[1])
    if not isinstance(clip, ClipPath):  # a name of nothing clips nothing
        return False
    if clip.values.get("clipPathUnits", "userSpaceOnUse") != "userSpaceOnUse":
        return True
    if any(each.values.get("clip-path", "none") != "none" for each in (clip, *clip)):
        return True
    area = filled_area(nonzero_outlines(pieces_of(shape, _CHORDS)))
    return bool((area - _clip_area(drawing, clip, frame)).area > _LOST * area.area)


def _clip_area(drawing: SVG, clip: ClipPath, frame: str) -> Geometry:
    """Finds the area that a clip leaves of what has the transform `frame`."""
    import shapely
    from svgelements import Matrix, Shape
    from svgelements import Path as Curve

    defined = Matrix(drawing.objects[CLIPS].values.get("transform") or "")
    moved = ~defined * Matrix(frame)
    areas = []
    for each in clip:
        if isinstance(each, Shape):
            pieces = pieces_of((Curve(each) * moved).reify(), _CHORDS)
            even_odd = _is_even_odd(each, "clip-rule")
            areas.append(filled_area(pieces if even_odd else nonzero_outlines(pieces)))
    return shapely.union_all(areas)


def _is_even_odd(shape: Shape, rule: str) -> bool:
    return str(shape.values.get(rule)).strip() == "evenodd"


def _is_hidden(element: SVGElement) -> bool:
    told = element.values
    return told.get("visibility") in ("hidden", "collapse") or _is_zero(told.get("opacity"))


def _paints(shape: Shape, kind: str) -> bool:
    colour = getattr(shape, kind)
    if colour is None or colour.value is None or colour.alpha == 0:
        return False
    return not _is_zero(shape.values.get(f"{kind}-opacity"))


def _is_zero(share: str | None) -> bool:
    return re.fullmatch(r"\s*[+-]?(0+\.?0*|\.0+)%?\s*", share or "") is not None
