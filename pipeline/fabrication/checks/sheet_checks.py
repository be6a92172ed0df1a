"""Checks one drawing: its curves, and its parts inside the margin, apart, cut to size, to scale."""

import re
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely import Geometry, STRtree, affinity

from pipeline.fabrication.checks.package_record import NOMINAL
from pipeline.fabrication.plates import MITRE
from pipeline.fabrication.readback import MILLIMETRES, OUTER, Curve, Drawing, Fault, closest
from pipeline.problem.sections import Fabrication, Laser
from sim.core import Floats

REFERENCE = "REFERENCE"
TOLERANCE = 1e-3
"""Lengths of a drawing are right to this, mm."""

INNER, SCORE, _ENGRAVE = "CUT_INNER", "SCORE", "ENGRAVE"
_LAYERS = (INNER, OUTER, _ENGRAVE, SCORE, REFERENCE)
_CUTS = (INNER, OUTER)
_CUT_KINDS = ("LWPOLYLINE", "POLYLINE", "CIRCLE", "PATH", "POLYGON", "RECT")
_LINE_KINDS = (*_CUT_KINDS, "LINE", "SIMPLELINE", "ARC")
_SHORTEST = 1e-4  # mm; segments below this count as none, so do gaps
_KERF_TOLERANCE = 2e-3
_LEAST_LETTER = 2.0  # mm
_JOINED = 0.05  # mm; strokes so near to each other make one letter
_SVG = re.compile(r"<svg[^>]*>", re.DOTALL)


def check_curves(drawing: Drawing) -> Iterator[Fault]:
    """Checks the curves of a drawing: closed, simple, apart, on the right layers."""
    yield from check_form(drawing)
    cuts = [curve for curve in drawing.curves if curve.layer in _CUTS and len(curve.points) > 2]
    for curve in cuts:
        if not curve.line.is_simple:
            what = f"a cut that crosses or repeats itself on layer {curve.layer}"
            yield drawing.fault(what, curve.part, (curve.line,))
    for first, second, spot in _intersections(cuts):
        what = f"a cut meets one of {second.part or 'another curve'}"
        yield drawing.fault(what, first.part, (first.line, spot))
    strokes = [c for c in drawing.curves if c.layer not in _CUTS and len(c.points) > 1]
    for first, second, spot in _intersections(strokes):
        if first.layer == second.layer and spot.length > _SHORTEST:
            what = f"a line twice on layer {first.layer}"
            yield drawing.fault(what, first.part, (first.line, spot))
    for part, curves in drawing.parts().items():
        outer = [c.polygon for c in curves if c.layer == OUTER and c.closed and len(c.points) > 2]
        for curve in curves:
            if curve.layer == INNER and not any(area.contains(curve.line) for area in outer):
                what = f"an inner cut outside of {part or 'a part'}"
                yield drawing.fault(what, part, (curve.line,))


def check_form(drawing: Drawing) -> Iterator[Fault]:
    """Checks layers, kinds, open ends and the order of cuts, without comparing curves."""
    owners: dict[str, str] = {}
    for layer, colour in drawing.colours.items():
        if layer not in _LAYERS:
            yield drawing.fault(f"a layer of name {layer!r} (known: {', '.join(_LAYERS)})")
        if owners.setdefault(colour, layer) != layer:
            yield drawing.fault(f"layers {owners[colour]} and {layer} have one colour")
    cut_out: set[str] = set()
    for curve in drawing.curves:
        for what in _curve_faults(curve):
            yield drawing.fault(what, curve.part, (curve.line,))
        if curve.layer == OUTER:
            cut_out.add(curve.part)
        elif curve.layer == INNER and curve.part in cut_out:
            what = "an inner cut comes after the outer one"
            yield drawing.fault(what, curve.part, (curve.line,))


def _curve_faults(curve: Curve) -> Iterator[str]:
    kinds = _CUT_KINDS if curve.layer in _CUTS else _LINE_KINDS
    if curve.kind not in kinds:
        yield f"a {curve.kind} on layer {curve.layer}, which cutters do not read"
        return
    if curve.own_colour:
        yield f"a {curve.kind} on layer {curve.layer} with a colour of its own"
    if curve.layer == OUTER and not curve.part:
        yield "an outer cut that belongs to no part"
    if curve.layer in _CUTS and not curve.closed:
        yield f"an open curve on layer {curve.layer}"
    ends = curve.points[:1] if curve.closed and len(curve.points) > 2 else curve.points[:0]
    lengths = np.linalg.norm(np.diff(np.vstack([curve.points, ends]), axis=0), axis=1)
    if len(lengths) == 0 or lengths.min() < _SHORTEST:
        yield f"a segment of no length on layer {curve.layer}"


def _intersections(curves: Sequence[Curve]) -> Iterator[tuple[Curve, Curve, Geometry]]:
    """Yields pairs of curves that cross, touch or overlap, and where they do."""
    lines = np.array([curve.line for curve in curves])
    if len(lines) == 0:
        return
    for first, second in STRtree(lines).query(lines, predicate="intersects").T:
        if first < second:
            yield curves[first], curves[second], lines[first].intersection(lines[second])


def check_sheet(drawing: Drawing, laser: Laser, thickness: float) -> Iterator[Fault]:
    """Checks a sheet: its scale, the place of its parts, its holes and its letters.

    Args:
        drawing: a written sheet.
        laser: settings of the sheets.
        thickness: of the material, mm; no hole may be smaller.
    """
    yield from check_scale(drawing, laser)
    yield from _check_places(drawing, laser)
    kerf = 0.0 if drawing.file.stem.endswith(NOMINAL) else laser.kerf
    for curve in drawing.curves:
        if curve.layer == INNER and curve.closed:
            width = rectangle_sides(curve.polygon)[0] + kerf
            if width < thickness - TOLERANCE:
                what = f"a hole {width:.2f} mm wide in material of {thickness:g} mm"
                remedy = "take thinner material, or ask for larger dots"
                remedy = f"{remedy} (fabrication.markers.diameter)"
                key = "laser.template_thickness"
                if drawing.file.name.startswith(("units", "coupon")):
                    remedy, key = "take thicker pins", "laser.pin"
                yield drawing.fault(what, curve.part, (curve.line,), key, remedy)
    yield from _check_letters(drawing)


def check_tabs(drawing: Drawing, settings: Fabrication) -> Iterator[Fault]:
    """Checks that pieces of foil, and no other parts, hang on the tabs asked for, within slots."""
    asked = settings.shims.tabs if drawing.file.name.startswith("shims") else None
    kerf = 0.0 if drawing.file.stem.endswith(NOMINAL) else settings.laser.kerf
    for curve in (curve for curve in drawing.curves if curve.layer == OUTER):
        count, key = 0 if asked is None else asked.count, "shims.tabs"
        if len(curve.tabs) != count:
            what = f"{len(curve.tabs)} tabs instead of {count}"
            yield drawing.fault(what, curve.part, (curve.line,), key)
        elif asked is not None:
            low, high = curve.points.min(axis=0), curve.points.max(axis=0)
            ends = curve.tabs.reshape(-1, 2)
            along, across = np.minimum(ends - low, high - ends).T
            wide = np.linalg.norm(np.diff(curve.tabs, axis=1), axis=-1) - kerf
            if np.abs(wide - asked.width).max() > _KERF_TOLERANCE:
                what = f"a tab {wide.max():.3f} mm wide instead of {asked.width:g} mm"
                yield drawing.fault(what, curve.part, (curve.line,), key)
            if across.max() > TOLERANCE or along.max() > settings.slots.depth_min + kerf:
                what = "a tab that is not on a long edge, within the slots"
                yield drawing.fault(what, curve.part, (curve.line,), key)


def check_scale(drawing: Drawing, laser: Laser) -> Iterator[Fault]:
    """Checks that the file is in millimetres and as large as the sheet."""
    if drawing.file.suffix == ".svg":
        width, height = (f"{round(length, 5):.9g}" for length in laser.sheet)
        head = _SVG.search(drawing.file.read_text(encoding="utf-8"))
        page = f'width="{width}mm"', f'height="{height}mm"', f'viewBox="0 0 {width} {height}"'
        for words in page:
            if head is None or words not in head.group():
                yield drawing.fault(f"the page does not say {words}", key="laser.sheet")
    elif drawing.version != "AC1009" and drawing.units != MILLIMETRES:
        yield drawing.fault(f"$INSUNITS is {drawing.units}, not {MILLIMETRES} (millimetres)")
    if not drawing.curves:
        yield drawing.fault("nothing is drawn")
        return
    points = np.concatenate([curve.points for curve in drawing.curves])
    low, high = points.min(axis=0), points.max(axis=0)
    if np.abs([*low, *(high - laser.sheet)]).max() > TOLERANCE:
        size = f"{low[0]:.3f} to {high[0]:.3f} and {low[1]:.3f} to {high[1]:.3f} mm"
        yield drawing.fault(f"it spans {size}, not the sheet from zero", key="laser.sheet")


def _check_places(drawing: Drawing, laser: Laser) -> Iterator[Fault]:
    """Checks that parts lie on the sheet less its margin, and apart."""
    room = shapely.box(0.0, 0.0, *laser.sheet).buffer(-laser.margin, join_style="mitre")
    parts = drawing.outlines()
    for part, outline in parts:
        if not room.buffer(TOLERANCE).covers(outline):
            what = f"it does not lie on the sheet less its margin of {laser.margin:g} mm"
            remedy = "give a larger sheet or a smaller margin"
            yield drawing.fault(what, part, (outline, room), "laser.sheet", remedy)
    shapes = np.array([outline for _, outline in parts])
    for first, second, gap in closest(shapes, laser.gap - TOLERANCE):
        what = f"{gap:.3f} mm from part {parts[second][0]}, less than {laser.gap:g} mm"
        yield drawing.fault(what, parts[first][0], (shapes[first], shapes[second]), "laser.gap")


def rectangle_sides(shape: Geometry) -> tuple[float, float]:
    """Measures the sides of the smallest rectangle around a shape, the smaller one first, mm."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shape))
    low, high = sorted(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1).tolist())
    return low, high


def _check_letters(drawing: Drawing) -> Iterator[Fault]:
    """Checks engraved letters: of the part around them, large enough, and on every unit."""
    units = drawing.file.name.startswith("units")  # whose letters may be cut by slots
    outlines: dict[str, list[Geometry]] = {}
    for part, outline in drawing.outlines():
        outlines.setdefault(part, []).append(outline)
    for part, curves in drawing.parts().items():
        strokes = [c.line for c in curves if c.layer == _ENGRAVE and len(c.points) > 1]
        if part not in outlines or not (strokes or units):
            continue
        area, written = shapely.union_all(outlines[part]), shapely.MultiLineString(strokes)
        shown, key, remedy = (area, written), "labels.height", "give smaller letters"
        if not strokes:
            yield drawing.fault("no id is engraved on it", part, (area,), key)
            continue
        if not area.covers(written):
            yield drawing.fault("engraving beyond its outline", part, shown, key, remedy)
        if units:
            continue
        pieces = shapely.get_parts(written.buffer(_JOINED))
        height = max(rectangle_sides(piece)[1] for piece in pieces) - 2 * _JOINED
        if height < _LEAST_LETTER - TOLERANCE:
            what = f"letters of {height:.2f} mm, less than {_LEAST_LETTER:g} mm"
            yield drawing.fault(what, part, shown, key, "give larger letters")


def check_compensation(
    cut: Sequence[Drawing], nominal: Sequence[Drawing], kerf: float
) -> Iterator[Fault]:
    """Checks compensated sheets against nominal ones: outer cuts k/2 out, inner ones in.

    Args:
        cut: all sheets of one kind of parts, with the kerf made good.
        nominal: the same parts at nominal size, maybe elsewhere on other sheets.
        kerf: width of the cut, mm.
    """
    ours, theirs = _closed_cuts(cut), _closed_cuts(nominal)
    if {key: len(cuts) for key, cuts in ours.items()} != {k: len(c) for k, c in theirs.items()}:
        yield cut[0].fault("other parts than at nominal size", key="laser.kerf")
        return
    for (part, layer), cuts in ours.items():
        shift = kerf / 2 if layer == OUTER else -kerf / 2
        way = _displacement(ours.get((part, OUTER), ()), theirs.get((part, OUTER), ()), kerf)
        for (drawing, curve), (_, drawn) in zip(cuts, theirs[part, layer], strict=True):
            if not _is_offset(curve.polygon, drawn.polygon, shift, way):
                what = f"not {abs(shift):g} mm {'out' if shift > 0 else 'in'} of the nominal cut"
                yield drawing.fault(what, part, (curve.line,), "laser.kerf")


def _closed_cuts(drawings: Sequence[Drawing]) -> dict[tuple[str, str], list[tuple[Drawing, Curve]]]:
    """Groups closed cuts by part and layer."""
    cuts: dict[tuple[str, str], list[tuple[Drawing, Curve]]] = {}
    for drawing in drawings:
        for curve in drawing.curves:
            if curve.layer in _CUTS and curve.closed:
                cuts.setdefault((curve.part, curve.layer), []).append((drawing, curve))
    return cuts


def _displacement(
    ours: Sequence[tuple[Drawing, Curve]], theirs: Sequence[tuple[Drawing, Curve]], kerf: float
) -> Floats:
    """Measures the way (2,) from a part to where it lies at nominal size; NaN of many alike."""
    if len(ours) != 1 or len(theirs) != 1:
        return np.full(2, np.nan)
    (_, curve), (_, drawn) = ours[0], theirs[0]
    sharp = drawn.polygon.buffer(kerf / 2, join_style="mitre", mitre_limit=MITRE)
    return _box_centre(sharp) - _box_centre(curve.polygon)


def _is_offset(cut: Geometry, nominal: Geometry, shift: float, way: Floats) -> bool:
    """Tests that a cut is the nominal one, grown by `shift`; corners may be round or sharp.

    Their part lies `way` (2,) from the nominal one; without a number, each cut for itself is laid
    on the nominal one.
    """
    if np.isnan(way).any():
        sharp = nominal.buffer(shift, join_style="mitre", mitre_limit=MITRE)
        way = _box_centre(sharp) - _box_centre(cut)
    least = nominal.buffer(shift - _KERF_TOLERANCE, quad_segs=8)
    most = nominal.buffer(shift + _KERF_TOLERANCE, join_style="mitre", mitre_limit=2 * MITRE)
    placed = affinity.translate(cut, *way)
    return bool(placed.covers(least) and most.covers(placed))


def _box_centre(shape: Geometry) -> Floats:
    return np.array(shape.bounds).reshape(2, 2).mean(axis=0)
