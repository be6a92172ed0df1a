"""Checks what lies on a sheet: parts inside its margin, apart, cut to size, legible, to scale."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import shapely
from shapely import Geometry, Polygon, STRtree

from pipeline.fabrication.checks.curve_checks import CUTS, ENGRAVE, INNER, line, named
from pipeline.fabrication.checks.curve_checks import polygon as bounded
from pipeline.fabrication.engraving import Reading, read_strokes
from pipeline.fabrication.readback import BUG, MILLIMETRES, OUTER, Curve, Drawing, Fault, aligned
from pipeline.problem.sections import Laser

NOMINAL = "nominal"
"""Ends the names of sheets without compensation for the kerf."""

TOLERANCE = 1e-3
"""Lengths of a drawing are right to this, mm."""

_KERF_TOLERANCE = 2e-3
_READ = 0.1  # mm, to which the height of letters is read that slots cut
_JOINED = 0.05  # mm; strokes so near to each other make one letter
_MATERIAL = "laser.template_thickness"
_SVG = re.compile(r"<svg[^>]*>", re.DOTALL)


def check(
    drawing: Drawing, laser: Laser, thickness: float, letters: Mapping[str, str]
) -> Iterator[Fault]:
    """Faults of a sheet: its scale, the place of its parts, its holes and its letters.

    Args:
        drawing: a written sheet.
        laser: what was asked for.
        thickness: of the material, mm; no hole may be smaller.
        letters: what small units carry instead of their ids, by id.
    """
    yield from check_scale(drawing, laser)
    yield from _places(drawing, laser)
    yield from _holes(drawing, thickness, laser)
    yield from _letters(drawing, letters)


def outlines(drawing: Drawing) -> list[tuple[str, Polygon]]:
    """Part and outer cut, in the order of the file."""
    found = (curve for curve in drawing.curves if curve.layer == OUTER and curve.closed)
    return [(curve.part, bounded(curve)) for curve in found]


def check_scale(drawing: Drawing, laser: Laser) -> Iterator[Fault]:
    """The file is in millimetres and as large as the sheet."""
    if drawing.file.suffix == ".svg":
        yield from _page(drawing, laser)
    elif drawing.version != "AC1009" and drawing.units != MILLIMETRES:
        yield _whole(drawing, f"$INSUNITS is {drawing.units}, not {MILLIMETRES} (millimetres)")
    points = np.concatenate([curve.points for curve in drawing.curves])
    low, high = points.min(axis=0), points.max(axis=0)
    if np.abs([*low, *(high - laser.sheet)]).max() > TOLERANCE:
        size = f"{low[0]:.3f} to {high[0]:.3f} and {low[1]:.3f} to {high[1]:.3f} mm"
        yield _whole(drawing, f"it spans {size}, not the sheet from zero", "laser.sheet")


def _page(drawing: Drawing, laser: Laser) -> Iterator[Fault]:
    """The SVG's own words: width and height in mm, and a view box of as many units."""
    width, height = (f"{length:g}" for length in laser.sheet)
    head = _SVG.search(drawing.file.read_text(encoding="utf-8"))
    wanted = (f'width="{width}mm"', f'height="{height}mm"', f'viewBox="0 0 {width} {height}"')
    for words in wanted:
        if head is None or words not in head.group():
            yield _whole(drawing, f"the page does not say {words}", "laser.sheet")


def _places(drawing: Drawing, laser: Laser) -> Iterator[Fault]:
    """Parts on the sheet less its margin, and apart."""
    room = shapely.box(0.0, 0.0, *laser.sheet).buffer(-laser.margin, join_style="mitre")
    parts = outlines(drawing)
    for part, outline in parts:
        if not room.buffer(TOLERANCE).covers(outline):
            what = f"it does not lie on the sheet less its margin of {laser.margin:g} mm"
            remedy = "give a larger sheet or a smaller margin"
            yield _on(drawing, part, what, "laser.sheet", remedy, (outline, room))
    shapes = np.array([outline for _, outline in parts])
    for first, second, gap in closest(shapes, laser.gap - TOLERANCE):
        what = f"{gap:.3f} mm from part {parts[second][0]}, less than {laser.gap:g} mm"
        shown = (shapes[first], shapes[second])
        yield _on(drawing, parts[first][0], what, "laser.gap", BUG, shown)


def closest(shapes: np.ndarray, gap: float) -> Iterator[tuple[int, int, float]]:
    """Pairs of shapes nearer to each other than `gap`, and their distance."""
    if len(shapes) == 0:
        return
    pairs = STRtree(shapes).query(shapes, predicate="dwithin", distance=gap).T
    for first, second in pairs[pairs[:, 0] < pairs[:, 1]]:
        yield int(first), int(second), float(shapely.distance(shapes[first], shapes[second]))


def _holes(drawing: Drawing, thickness: float, laser: Laser) -> Iterator[Fault]:
    """Holes that a laser can cut: no smaller than the material is thick, once they are cut."""
    kerf = 0.0 if drawing.file.stem.endswith(NOMINAL) else laser.kerf
    for curve in drawing.curves:
        if curve.layer != INNER or not curve.closed:
            continue
        width = narrowest(bounded(curve)) + kerf
        if width < thickness - TOLERANCE:
            what = f"a hole {width:.2f} mm wide in material of {thickness:g} mm"
            remedy = "take thinner material, or ask for larger dots (fabrication.markers.diameter)"
            yield _on(drawing, curve.part, what, _MATERIAL, remedy, (line(curve),))


def narrowest(shape: Geometry) -> float:
    """The smaller side of the smallest rectangle around a shape."""
    return min(_sides(shape))


def widest(shape: Geometry) -> float:
    """The larger side of the smallest rectangle around a shape."""
    return max(_sides(shape))


def _sides(shape: Geometry) -> tuple[float, float]:
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shape))
    sides = np.linalg.norm(np.diff(corners[:3], axis=0), axis=1)
    return float(sides[0]), float(sides[1])


def _letters(drawing: Drawing, letters: Mapping[str, str]) -> Iterator[Fault]:
    """Engraved letters of each part, inside of the part; those of a unit are its id."""
    units = drawing.file.name.startswith("units")
    read = ids(drawing, letters) if units else {}
    for part, curves in drawing.parts().items():
        strokes = [curve for curve in curves if curve.layer == ENGRAVE and len(curve.points) > 1]
        outer = [bounded(curve) for curve in curves if curve.layer == OUTER and curve.closed]
        if outer and (strokes or units):
            written = shapely.MultiLineString([line(curve) for curve in strokes])
            shown = (shapely.union_all(outer), written)
            if not shown[0].covers(written):
                what, remedy = "engraving beyond its outline", "give smaller letters"
                yield _on(drawing, part, what, "labels.height", remedy, shown)
            height = _of_letters(written)
            if units:
                height = read[part].height if part in read else 0.0
            if height < read_strokes.LEAST - (_READ if units else TOLERANCE):
                what = f"letters of {height:.2f} mm, less than {read_strokes.LEAST:g} mm"
                if height == 0.0:
                    what = "what is engraved does not show its id and how it stands"
                yield _on(drawing, part, what, "labels.height", "give larger letters", shown)


def ids(drawing: Drawing, letters: Mapping[str, str]) -> dict[str, Reading]:
    """How the ids of parts stand that can be read, by id; small ones carry `letters` instead."""
    read = {}
    for part, curves in drawing.parts().items():
        strokes = [curve.points for curve in curves if curve.layer == ENGRAVE]
        found = read_strokes.read(letters.get(part, part), strokes)
        if found is not None:
            read[part] = found
    return read


def _of_letters(written: Geometry) -> float:
    """Height of the largest letter of any text."""
    pieces = shapely.get_parts(shapely.unary_union(written.buffer(_JOINED)))
    return max(widest(piece) - 2 * _JOINED for piece in pieces)


def compensation(
    cut: Sequence[Drawing], nominal: Sequence[Drawing], kerf: float
) -> Iterator[Fault]:
    """Faults of compensated sheets against nominal ones: outer cuts k/2 out, inner ones in.

    Args:
        cut: all sheets of one kind of parts, with the kerf made good.
        nominal: the same parts at nominal size, maybe elsewhere on other sheets.
        kerf: width of the cut, mm.
    """
    made, wanted = _cuts(cut), _cuts(nominal)
    if {key: len(found) for key, found in made.items()} != {k: len(f) for k, f in wanted.items()}:
        yield _whole(cut[0], "other parts than at nominal size", "laser.kerf")
        return
    for (part, layer), found in made.items():
        shift = kerf / 2 if layer == OUTER else -kerf / 2
        for (drawing, curve), (_, drawn) in zip(found, wanted[part, layer], strict=True):
            if not _offset(curve, drawn, shift):
                what = f"not {abs(shift):g} mm {'out' if shift > 0 else 'in'} of the nominal cut"
                yield _on(drawing, part, what, "laser.kerf", BUG, (line(curve),))


def _cuts(drawings: Sequence[Drawing]) -> dict[tuple[str, str], list[tuple[Drawing, Curve]]]:
    """Closed cuts by part and layer."""
    found: dict[tuple[str, str], list[tuple[Drawing, Curve]]] = {}
    for drawing in drawings:
        for curve in drawing.curves:
            if curve.layer in CUTS and curve.closed:
                found.setdefault((curve.part, curve.layer), []).append((drawing, curve))
    return found


def _offset(curve: Curve, drawn: Curve, shift: float) -> bool:
    """Whether a cut is the nominal one moved by `shift`; corners may be round or sharp."""
    nominal, made = bounded(drawn), bounded(curve)
    sharp = nominal.buffer(shift, join_style="mitre", mitre_limit=10.0)
    least = nominal.buffer(shift - _KERF_TOLERANCE, quad_segs=8)
    most = nominal.buffer(shift + _KERF_TOLERANCE, join_style="mitre", mitre_limit=10.0)
    boxed = shapely.affinity.translate(made, *_between(made, sharp))
    if boxed.covers(least) and most.covers(boxed):
        return True
    placed = aligned(sharp, made)
    return bool(placed.covers(least) and most.covers(placed))


def _between(shape: Geometry, other: Geometry) -> tuple[float, float]:
    """Shift from the middle of one shape's box to that of another's."""
    before, after = (np.array(s.bounds).reshape(2, 2).mean(axis=0) for s in (shape, other))
    return float(after[0] - before[0]), float(after[1] - before[1])


def _on(
    drawing: Drawing,
    part: str,
    what: str,
    key: str,
    remedy: str,
    shown: tuple[Geometry, ...],
) -> Fault:
    return Fault(named(part), what, key, remedy, drawing.file, shown, shown[-1])


def _whole(drawing: Drawing, what: str, key: str = "laser") -> Fault:
    return Fault("the drawing", what, key, BUG, drawing.file)
