"""Reads a written drawing, DXF or SVG, as plain curves in millimetres, y up.

Nothing here knows how the files are made: DXF goes through ezdxf's reader and its auditor, SVG
through svgelements. In a DXF extended data under the name METACLOAK tell the part of a curve, in an
SVG the label of an outer cut does. All else belongs to the outline around it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import Geometry, LineString, Point, Polygon, STRtree

from pipeline.fabrication.readback.faults import BUG, Fault, unreadable
from sim.core import Floats

if TYPE_CHECKING:
    from ezdxf.entities.dxfentity import DXFEntity


OUTER = "CUT_OUTER"
MILLIMETRES = 4
"""Value of $INSUNITS."""

_APPLICATION = "METACLOAK"
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_BYLAYER = 256
_WIDEST_TAB = 1.01  # mm, with the kerf; parts are larger
_FLATNESS = 2e-4  # mm, to which curves become polygons
_TURN = np.linspace(0.0, 2.0 * np.pi, 128, endpoint=False)
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN)])


@dataclass(frozen=True)
class Curve:
    """Holds one entity of a drawing."""

    part: str  # id of the part that it belongs to, "" if there is none
    layer: str
    kind: str  # its name in the file's format
    points: Floats  # vertices (n, 2) in mm, a closed curve without the repeated first one
    closed: bool  # the file says that it ends where it starts
    own_colour: bool = False  # another one than its layer's
    # (k, 2, 2) ends of the places of an outer cut that the file leaves uncut
    tabs: Floats = field(default_factory=lambda: np.empty((0, 2, 2)))

    @cached_property
    def polygon(self) -> Polygon:
        """The area of a closed curve."""
        return Polygon(self.points)

    @cached_property
    def line(self) -> Geometry:
        """The curve as a line; a closed one comes back to its start."""
        if len(self.points) < 2:
            return Point(self.points[0]) if len(self.points) else Point()
        return LineString(np.vstack([self.points, self.points[:1]]) if self.closed else self.points)


@dataclass(frozen=True)
class Drawing:
    """Holds a file's curves in the order in which they are written, and its other statements.

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
        """Groups the curves by part, parts in the order of their first curve."""
        groups: dict[str, list[Curve]] = {}
        for curve in self.curves:
            groups.setdefault(curve.part, []).append(curve)
        return groups

    def outlines(self) -> list[tuple[str, Polygon]]:
        """Lists part and outer cut, in the order of the file."""
        outer = (curve for curve in self.curves if curve.layer == OUTER and curve.closed)
        return [(curve.part, curve.polygon) for curve in outer if len(curve.points) > 2]

    def fault(
        self,
        what: str,
        part: str | None = None,
        shown: tuple[Geometry, ...] = (),
        key: str = "laser",
        remedy: str = BUG,
    ) -> Fault:
        """Makes a fault of a part, or of the whole drawing; the last shape shown is the spot."""
        words = f"part {part}" if part else "a curve that belongs to no part"
        words = "the drawing" if part is None else words
        return Fault(words, what, key, remedy, self.file, shown, shown[-1] if shown else None)


def read_drawing(path: Path) -> Drawing:
    """Reads a DXF or an SVG.

    Raises:
        UserError: it cannot be read as what its name says.
    """
    drawing = _read_svg(path) if path.suffix == ".svg" else _read_dxf(path)
    drawing = replace(drawing, curves=tuple(_joined(drawing.curves)))
    outlines = [(part, outline) for part, outline in drawing.outlines() if part]
    curves = list(drawing.curves)
    lost = [
        number
        for number, curve in enumerate(curves)
        if not curve.part and curve.layer != OUTER and len(curve.points)
    ]
    starts = np.array([curves[number].points[0] for number in lost]).reshape(-1, 2)
    tree = STRtree([outline for _, outline in outlines])
    around = tree.query(shapely.points(starts), predicate="intersects").T
    first = dict(sorted(around.tolist(), reverse=True))  # outline around each
    for at, outer in first.items():
        curves[lost[at]] = replace(curves[lost[at]], part=outlines[outer][0])
    return replace(drawing, curves=tuple(curves))


def _joined(curves: Iterable[Curve]) -> Iterator[Curve]:
    """Closes outer cuts that tabs interrupt, piece after piece; others stay open.

    A cut is closed where a piece ends a tab's width from where the first one begins.
    """
    run: list[Curve] = []
    for curve in curves:
        piece = curve.layer == OUTER and not curve.closed and len(curve.points) > 1
        if not piece or (run and (curve.part != run[0].part or not _near(run[-1], curve))):
            yield from run
            run = []
        if not piece:
            yield curve
            continue
        run.append(curve)
        if _near(curve, run[0]):
            tabs = [(a.points[-1], b.points[0]) for a, b in pairwise([*run, run[0]])]
            points = np.concatenate([each.points for each in run])
            yield replace(run[0], points=points, closed=True, tabs=np.array(tabs))
            run = []
    yield from run


def _near(one: Curve, other: Curve) -> bool:
    """Tests that no more than a tab is between the end of one curve and the start of another."""
    return bool(np.linalg.norm(other.points[0] - one.points[-1]) < _WIDEST_TAB)


def _read_dxf(path: Path) -> Drawing:
    """Reads a DXF file to which ezdxf's auditor does not object."""
    from ezdxf.filemanagement import readfile
    from ezdxf.lldxf.const import DXFError

    try:
        document = readfile(path)
    except (OSError, DXFError) as error:
        raise unreadable("a drawing", path, error) from error
    auditor = document.audit()
    if troubles := [*auditor.errors, *auditor.fixes]:
        raise unreadable("a drawing", path, troubles[0].message)
    curves = tuple(_dxf_curve(entity) for entity in document.modelspace())
    used = sorted({curve.layer for curve in curves})
    colours = {name: str(document.layers.get(name).color) for name in used}
    units = int(document.header.get("$INSUNITS", 0)) or None
    return Drawing(path, curves, colours, units=units, version=str(document.dxfversion))


def _dxf_curve(entity: DXFEntity) -> Curve:
    """Flattens an entity; one without an outline has no vertices."""
    from ezdxf import path

    kind, layer, part = entity.dxftype(), str(entity.dxf.layer), ""
    if entity.has_xdata(_APPLICATION):
        words = [str(tag.value) for tag in entity.get_xdata(_APPLICATION) if tag.code == 1000]
        part = words[0] if words else ""
    own = int(entity.dxf.get("color", _BYLAYER)) != _BYLAYER
    try:
        points = _straight_points(entity)
        if points is None:
            outline = path.make_path(entity)
            points = np.array([(p.x, p.y) for p in outline.flattening(_FLATNESS)]).reshape(-1, 2)
    except TypeError:
        return Curve(part, layer, kind, np.empty((0, 2)), closed=False, own_colour=own)
    closed = kind == "CIRCLE" or bool(getattr(entity, "is_closed", False))
    return Curve(part, layer, kind, _without_return(points, closed), closed, own)


def _straight_points(entity: DXFEntity) -> Floats | None:
    """Lists the points (n, 2) of a flat polyline without arcs, as its path would; None of others.

    A closed one comes back to its start.
    """
    from ezdxf.entities.lwpolyline import LWPolyline
    from ezdxf.entities.polyline import Polyline

    if entity.dxf.hasattr("extrusion"):
        return None
    if isinstance(entity, LWPolyline):
        values = entity.lwpoints.values
        if values[:, 4].any():
            return None
        points = values[:, :2]
    elif isinstance(entity, Polyline) and entity.is_2d_polyline and not entity.has_arc:
        points = np.array([point.xyz for point in entity.points()]).reshape(-1, 3)[:, :2]
    else:
        return None
    if entity.is_closed and (points[:1] != points[-1:]).any():
        points = np.concatenate([points, points[:1]])
    return points if len(points) > 1 else points[:0]


def _without_return(points: Floats, closed: bool) -> Floats:
    if closed and len(points) > 1 and (np.abs(points[0] - points[-1]) <= 1e-9).all():
        return points[:-1]
    return points


def _read_svg(path: Path) -> Drawing:
    """Reads an SVG file; its height turns y up."""
    from xml.etree.ElementTree import ParseError

    from svgelements import SVG

    try:
        page = SVG.parse(str(path), ppi=25.4, reify=True)
    except (OSError, ParseError, ValueError) as error:
        raise unreadable("a drawing", path, error) from error
    size = (float(page.width), float(page.height))
    curves: list[Curve] = []
    colours: dict[str, str] = {}
    for curve, colour in _svg_curves(page, "", size[1]):
        own = colours.setdefault(curve.layer, colour) != colour
        curves.append(replace(curve, own_colour=own))
    return Drawing(path, tuple(curves), colours, size=size)


def _svg_curves(group: Any, layer: str, height: float) -> Iterator[tuple[Curve, str]]:  # noqa: ANN401
    """Yields one curve for each stroke of each shape, and its colour."""
    from svgelements import Circle, Group, Image, Path, Shape, Text

    for element in group:
        kind = type(element).__name__.upper()
        if isinstance(element, Group):
            yield from _svg_curves(element, element.values.get("id") or layer, height)
        elif isinstance(element, Text | Image):
            yield Curve("", layer, kind, np.empty((0, 2)), closed=False), str(element.stroke)
        elif isinstance(element, Shape):
            part = str(element.values["attributes"].get(_LABEL, ""))
            if isinstance(element, Circle):
                centre = [element.implicit_center.x, element.implicit_center.y]
                strokes = [(centre + float(element.implicit_r) * _CIRCLE, True)]
            else:
                outline = element if isinstance(element, Path) else Path(element)
                strokes = [_svg_points(stroke) for stroke in outline.as_subpaths()]
            for points, closed in strokes:
                turned = points * [1.0, -1.0] + [0.0, height]
                yield Curve(part, layer, kind, turned, closed), str(element.stroke)


def _svg_points(stroke: Any) -> tuple[Floats, bool]:  # noqa: ANN401
    """Flattens a stroke: its vertices (n, 2), and whether it is closed."""
    from svgelements import Arc, Close, CubicBezier, QuadraticBezier

    points: list[tuple[float, float]] = []
    closed = False
    for segment in stroke:
        if isinstance(segment, Close):
            closed = True
        elif isinstance(segment, Arc | CubicBezier | QuadraticBezier):
            points += [tuple(segment.point(t)) for t in np.linspace(0.0, 1.0, 65)[1:]]
        elif segment.end is not None:
            points.append((float(segment.end.x), float(segment.end.y)))
    return _without_return(np.array(points, dtype=float).reshape(-1, 2), closed), closed


def closest(shapes: np.ndarray, gap: float) -> Iterator[tuple[int, int, float]]:
    """Yields pairs of shapes nearer to each other than `gap`, mm, and their distance."""
    if len(shapes) == 0:
        return
    pairs = STRtree(shapes).query(shapes, predicate="dwithin", distance=gap).T
    for first, second in pairs[pairs[:, 0] < pairs[:, 1]]:
        yield int(first), int(second), float(shapely.distance(shapes[first], shapes[second]))
