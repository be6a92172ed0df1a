"""Checks the curves of one drawing: closed, simple, apart from each other, on the right layers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import shapely
from shapely import Geometry, LineString, Point, Polygon, STRtree

from pipeline.fabrication.readback import BUG, OUTER, Curve, Drawing, Fault

INNER, ENGRAVE, SCORE, REFERENCE = "CUT_INNER", "ENGRAVE", "SCORE", "REFERENCE"
LAYERS = (INNER, OUTER, ENGRAVE, SCORE, REFERENCE)
CUTS = (INNER, OUTER)
CUT_KINDS = ("LWPOLYLINE", "POLYLINE", "CIRCLE", "PATH", "POLYGON", "RECT")
LINE_KINDS = (*CUT_KINDS, "LINE", "SIMPLELINE", "ARC")
SHORTEST = 1e-4
"""Segments below this, mm, count as none; so do gaps."""


def check(drawing: Drawing) -> Iterator[Fault]:
    """Faults of a drawing's curves."""
    yield from check_form(drawing)
    for curve in drawing.curves:
        if curve.layer in CUTS and len(curve.points) > 2 and not line(curve).is_simple:
            what = f"a cut that crosses or repeats itself on layer {curve.layer}"
            yield _fault(drawing, curve, what)
    cuts = [curve for curve in drawing.curves if curve.layer in CUTS and len(curve.points) > 2]
    yield from _crossings(drawing, cuts)
    yield from _doubled(drawing, [curve for curve in drawing.curves if curve.layer not in CUTS])
    yield from _holes_in_place(drawing)


def check_form(drawing: Drawing) -> Iterator[Fault]:
    """Faults that show without comparing curves: layers, kinds, open ends, order of cuts."""
    yield from _layers(drawing)
    for curve in drawing.curves:
        for what in _of_curve(curve):
            yield _fault(drawing, curve, what)
    yield from _order(drawing)


def polygon(curve: Curve) -> Polygon:
    """What a closed curve bounds."""
    return Polygon(curve.points)


def line(curve: Curve) -> Geometry:
    """The curve as a line; a closed one comes back to its start."""
    points = curve.points
    if len(points) < 2:
        return Point(points[0]) if len(points) else Point()
    return LineString(np.vstack([points, points[:1]]) if curve.closed else points)


def _layers(drawing: Drawing) -> Iterator[Fault]:
    """One fault a layer that is unknown or shares its colour with another."""
    owners: dict[str, str] = {}
    for layer, colour in drawing.colours.items():
        if layer not in LAYERS:
            yield _whole(drawing, f"a layer of name {layer!r} (known: {', '.join(LAYERS)})")
        if owners.setdefault(colour, layer) != layer:
            yield _whole(drawing, f"layers {owners[colour]} and {layer} have one colour")


def _of_curve(curve: Curve) -> Iterator[str]:
    """What is wrong with a curve by itself."""
    kinds = CUT_KINDS if curve.layer in CUTS else LINE_KINDS
    if curve.kind not in kinds:
        yield f"a {curve.kind} on layer {curve.layer}, which cutters do not read"
        return
    if curve.own_colour:
        yield f"a {curve.kind} on layer {curve.layer} with a colour of its own"
    if curve.layer == OUTER and not curve.part:
        yield "an outer cut that belongs to no part"
    if curve.layer in CUTS and not curve.closed:
        yield f"an open curve on layer {curve.layer}"
    lengths = np.linalg.norm(np.diff(_ring(curve), axis=0), axis=1)
    if len(lengths) == 0 or lengths.min() < SHORTEST:
        yield f"a segment of no length on layer {curve.layer}"


def _ring(curve: Curve) -> np.ndarray:
    closed = curve.closed and len(curve.points) > 2
    return np.vstack([curve.points, curve.points[:1]]) if closed else curve.points


def _crossings(drawing: Drawing, cuts: list[Curve]) -> Iterator[Fault]:
    """Cuts that meet: crossing, touching, overlapping or drawn twice."""
    lines = np.array([line(curve) for curve in cuts])
    for first, second in _meeting(lines):
        spot = shapely.intersection(lines[first], lines[second])
        other = cuts[second].part or "another curve"
        yield _fault(drawing, cuts[first], f"a cut meets one of {other}", spot)


def _doubled(drawing: Drawing, curves: list[Curve]) -> Iterator[Fault]:
    """Engraved or scored strokes that run along each other."""
    kept = [curve for curve in curves if len(curve.points) > 1]
    lines = np.array([line(curve) for curve in kept])
    for first, second in _meeting(lines):
        spot = shapely.intersection(lines[first], lines[second])
        if kept[first].layer == kept[second].layer and spot.length > SHORTEST:
            yield _fault(drawing, kept[first], f"a line twice on layer {kept[first].layer}", spot)


def _meeting(lines: np.ndarray) -> Iterator[tuple[int, int]]:
    if len(lines) == 0:
        return
    for first, second in STRtree(lines).query(lines, predicate="intersects").T:
        if first < second:
            yield int(first), int(second)


def _order(drawing: Drawing) -> Iterator[Fault]:
    """Holes of each part are cut before its outline."""
    cut_out: set[str] = set()
    for curve in drawing.curves:
        if curve.layer == OUTER:
            cut_out.add(curve.part)
        elif curve.layer == INNER and curve.part in cut_out:
            yield _fault(drawing, curve, "an inner cut comes after the outer one")


def _holes_in_place(drawing: Drawing) -> Iterator[Fault]:
    """Holes lie inside of the outline of their part."""
    for part, curves in drawing.parts().items():
        outers = [polygon(c) for c in curves if c.layer == OUTER and c.closed and len(c.points) > 2]
        for curve in curves:
            if curve.layer == INNER and not _held(curve, outers):
                yield _fault(drawing, curve, f"an inner cut outside of {part or 'a part'}")


def _held(curve: Curve, outers: Iterable[Polygon]) -> bool:
    return any(outer.contains(line(curve)) for outer in outers)


def _fault(drawing: Drawing, curve: Curve, what: str, spot: Geometry | None = None) -> Fault:
    shown = (line(curve),)
    where = spot if spot is not None else shown[0]
    return Fault(named(curve.part), what, "laser", BUG, drawing.file, shown, where)


def _whole(drawing: Drawing, what: str) -> Fault:
    return Fault("the drawing", what, "laser", BUG, drawing.file)


def named(part: str) -> str:
    """A part in words."""
    return f"part {part}" if part else "a curve that belongs to no part"
