"""Reads a written drawing, DXF or SVG, as plain curves in millimetres, y up.

Nothing here knows how the files are made: DXF goes through ezdxf's recovering reader and its
auditor, SVG through svgelements. An outer cut says of which part it is: in a DXF by extended data
under the name METACLOAK, in an SVG by its label. All else belongs to the outline that it lies in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from shapely import Point, Polygon, STRtree

from pipeline.fabrication.readback.faults import BUG
from pipeline.runtime import UserError
from sim.core import Floats

if TYPE_CHECKING:
    from ezdxf.entities.dxfentity import DXFEntity


OUTER = "CUT_OUTER"
APPLICATION = "METACLOAK"
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
BYLAYER = 256
MILLIMETRES = 4
FLATNESS = 2e-4
"""Curves become polygons that are this true to them, mm."""

_TURN = np.linspace(0.0, 2.0 * np.pi, 128, endpoint=False)
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN)])


@dataclass(frozen=True)
class Curve:
    """One entity of a drawing.

    Attributes:
        part: id of the part that it belongs to, "" if there is none.
        layer: its layer.
        kind: what the file calls it.
        points: vertices (n, 2) in mm, a closed curve without the repeated first one.
        closed: whether the file says that it ends where it starts.
        own_colour: whether it has another colour than its layer's.
    """

    part: str
    layer: str
    kind: str
    points: Floats
    closed: bool
    own_colour: bool = False


@dataclass(frozen=True)
class Drawing:
    """A file's curves in the order in which they are written, and what else it says.

    `colours` are those of the layers that are used; `size` is the page (width, height) in mm of an
    SVG; `units` and `version` are a DXF's $INSUNITS and $ACADVER.
    """

    file: Path
    curves: tuple[Curve, ...]
    colours: dict[str, str]
    size: tuple[float, float] | None = None
    units: int | None = None
    version: str = ""

    def parts(self) -> dict[str, list[Curve]]:
        """The curves by part, parts in the order of their first curve."""
        found: dict[str, list[Curve]] = {}
        for curve in self.curves:
            found.setdefault(curve.part, []).append(curve)
        return found


def read(path: Path) -> Drawing:
    """The drawing in a file.

    Raises:
        UserError: it cannot be read as what its name says.
    """
    drawing = read_svg(path) if path.suffix == ".svg" else read_dxf(path)
    return replace(drawing, curves=_owned(drawing.curves))


def _owned(curves: tuple[Curve, ...]) -> tuple[Curve, ...]:
    """The curves; those that tell no part get that of the outline around them."""
    outlines = [curve for curve in curves if curve.layer == OUTER and curve.closed]
    named = [curve for curve in outlines if curve.part and len(curve.points) > 2]
    tree = STRtree([Polygon(curve.points) for curve in named])

    def owner(curve: Curve) -> str:
        if curve.part or curve.layer == OUTER or len(curve.points) == 0:
            return curve.part
        around = tree.query(Point(curve.points[0]), predicate="intersects")
        return named[int(min(around))].part if len(around) else ""

    return tuple(replace(curve, part=owner(curve)) for curve in curves)


def read_dxf(path: Path) -> Drawing:
    """The drawing in a DXF file that its auditor has nothing to say about."""
    from ezdxf import recover
    from ezdxf.lldxf.const import DXFError

    try:
        whole = path.read_bytes().split()[-1:] == [b"EOF"]
        document, auditor = recover.readfile(path)
    except (OSError, DXFError) as error:
        raise _unreadable(path, str(error)) from error
    if not whole:  # which the recovering reader does not mind
        raise _unreadable(path, "its end is missing")
    if troubles := [*auditor.errors, *auditor.fixes]:
        raise _unreadable(path, troubles[0].message)
    curves = tuple(_of_dxf(entity) for entity in document.modelspace())
    used = sorted({curve.layer for curve in curves})
    colours = {name: str(document.layers.get(name).color) for name in used}
    units = int(document.header.get("$INSUNITS", 0)) or None
    return Drawing(path, curves, colours, units=units, version=str(document.dxfversion))


def read_svg(path: Path) -> Drawing:
    """The drawing in an SVG file; its height turns y up."""
    from xml.etree.ElementTree import ParseError

    from svgelements import SVG

    try:
        page = SVG.parse(str(path), ppi=25.4, reify=True)
    except (OSError, ParseError, ValueError) as error:
        raise _unreadable(path, str(error)) from error
    size = (float(page.width), float(page.height))
    found = list(_of_svg(page, "", size[1]))
    colours: dict[str, str] = {}
    for curve, colour in found:
        colours.setdefault(curve.layer, colour)
    curves = tuple(
        Curve(c.part, c.layer, c.kind, c.points, c.closed, colour != colours[c.layer])
        for c, colour in found
    )
    return Drawing(path, curves, colours, size=size)


def _of_dxf(entity: DXFEntity) -> Curve:
    kind = entity.dxftype()
    points, closed = _flattened(entity, kind)
    layer = str(entity.dxf.layer)
    colour = int(entity.dxf.get("color", BYLAYER))
    return Curve(_named(entity), layer, kind, points, closed, own_colour=colour != BYLAYER)


def _named(entity: DXFEntity) -> str:
    if not entity.has_xdata(APPLICATION):
        return ""
    words = [str(tag.value) for tag in entity.get_xdata(APPLICATION) if tag.code == 1000]
    return words[0] if words else ""


def _flattened(entity: Any, kind: str) -> tuple[Floats, bool]:  # noqa: ANN401  (any entity)
    """Vertices and closedness; an entity without an outline has no vertices."""
    from ezdxf import path

    try:
        outline = path.make_path(entity)
    except TypeError:
        return np.empty((0, 2)), False
    points = np.array([(p.x, p.y) for p in outline.flattening(FLATNESS)]).reshape(-1, 2)
    closed = kind == "CIRCLE" or bool(getattr(entity, "is_closed", False))
    return _without_return(points, closed), closed


def _without_return(points: Floats, closed: bool) -> Floats:
    if closed and len(points) > 1 and np.allclose(points[0], points[-1], rtol=0, atol=1e-9):
        return points[:-1]
    return points


def _of_svg(group: Any, layer: str, height: float) -> Iterator[tuple[Curve, str]]:  # noqa: ANN401
    from svgelements import Group, Image, Shape, Text

    for element in group:
        if isinstance(element, Group):
            yield from _of_svg(element, element.values.get("id") or layer, height)
        elif isinstance(element, Shape):
            yield from _shape(element, layer, height)
        elif isinstance(element, Text | Image):
            kind = type(element).__name__.upper()
            yield Curve("", layer, kind, np.empty((0, 2)), closed=False), str(element.stroke)


def _shape(shape: Any, layer: str, height: float) -> Iterator[tuple[Curve, str]]:  # noqa: ANN401
    """One curve for each stroke of the shape's path."""
    from svgelements import Circle
    from svgelements import Path as SvgPath

    kind = type(shape).__name__.upper()
    part = str(shape.values["attributes"].get(LABEL, ""))
    if isinstance(shape, Circle):
        centre = np.array([shape.implicit_center.x, shape.implicit_center.y])
        outlines = [(centre + float(shape.implicit_r) * _CIRCLE, True)]
    else:
        outlines = [_polygon(stroke) for stroke in SvgPath(shape).as_subpaths()]
    for points, closed in outlines:
        turned = points * [1.0, -1.0] + [0.0, height]
        yield Curve(part, layer, kind, turned, closed), str(shape.stroke)


def _polygon(stroke: Any) -> tuple[Floats, bool]:  # noqa: ANN401
    from svgelements import Arc, Close, CubicBezier, Move, QuadraticBezier

    points: list[tuple[float, float]] = []
    closed = False
    for segment in stroke:
        if isinstance(segment, Close):
            closed = True
        elif isinstance(segment, Arc | CubicBezier | QuadraticBezier):
            points += [tuple(segment.point(t)) for t in np.linspace(0.0, 1.0, 65)[1:]]
        elif isinstance(segment, Move) or segment.end is not None:
            points.append((float(segment.end.x), float(segment.end.y)))
    return _without_return(np.array(points, dtype=float).reshape(-1, 2), closed), closed


def _unreadable(path: Path, why: str) -> UserError:
    return UserError(
        f"a drawing that was just written cannot be read back: {why}",
        file=path,
        remedy=BUG,
    )
