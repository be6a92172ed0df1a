"""Checks the folder laser/ as a whole: every format of every sheet, and all parts exactly once."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
import shapely
from shapely import Geometry, Point, Polygon

from pipeline.fabrication.checks.assembled_specimen import check_outline
from pipeline.fabrication.checks.bill_checks import check_shim_pieces
from pipeline.fabrication.checks.package_record import NOMINAL, PackageRecord
from pipeline.fabrication.checks.sheet_checks import (
    INNER,
    REFERENCE,
    SCORE,
    TOLERANCE,
    check_compensation,
    check_curves,
    check_form,
    check_scale,
    check_sheet,
    check_tabs,
    rectangle_sides,
)
from pipeline.fabrication.papers import BILL, read_bill
from pipeline.fabrication.readback import BUG, Curve, Drawing, Fault, read_drawing
from pipeline.problem.sections import Fabrication
from sim.core import Floats

_OFF = 0.02  # mm of dots beside the middle of their unit
_RIM = 0.25  # mm around a dot


def check_laser(record: PackageRecord) -> Iterator[Fault]:
    """Checks all drawings in a package."""
    variants, settings = record.drawings, record.settings
    units = variants.get(("units", NOMINAL), [])
    outlines = [(part, shape, sheet.file) for sheet in units for part, shape in sheet.outlines()]
    counts = Counter(part for part, _, _ in outlines)
    yield from record.check_units(counts, record.folder / "laser")
    for label, shape, file in outlines:
        if label in record.expected.polygons:
            yield from check_outline(label, file, shape, record.shapes)
    yield from _check_pins(record)
    yield from _check_dots(record)
    shims = variants.get(("shims", NOMINAL), [])
    yield from check_shim_pieces(record.folder / BILL, shims)
    for drawing in (drawing for sheets in variants.values() for drawing in sheets):
        yield from check_curves(drawing)
        yield from check_sheet(drawing, settings.laser, _thickness(drawing.file, settings))
        yield from check_tabs(drawing, settings)
        yield from _check_formats(drawing, settings)
    yield from _check_kerfs(record)


def _thickness(file: Path, settings: Fabrication) -> float:
    """Looks up the material that a sheet is cut from, by the file's name; mm."""
    layer, foil = settings.laser_sheet_thickness, settings.shims.thickness
    kinds = {"units": layer, "coupon": layer, "shims": foil}
    return kinds.get(file.name.partition("_")[0], settings.laser.template_thickness)


def _check_pins(record: PackageRecord) -> Iterator[Fault]:
    """Checks holes for pins: as many as pins in the bill, true to size, walls around each.

    All layers of a unit, or of the coupon, are cut by one drawing: a stack of them is aligned where
    its pins are.
    """
    settings, found = record.settings, 0
    cut = (
        sheet for kind in ("units", "coupon") for sheet in record.drawings.get((kind, NOMINAL), [])
    )
    for drawing in cut:
        outlines = dict(drawing.outlines())
        for part, curves in drawing.parts().items():
            holes = [curve.polygon for curve in curves if curve.layer == INNER and curve.closed]
            found += len(holes)
            walls = [float(outlines[part].exterior.distance(hole)) for hole in holes]
            walls += [float(one.distance(other)) for one, other in combinations(holes, 2)]
            if min(walls, default=settings.minimum_wall) < settings.minimum_wall - TOLERANCE:
                what = f"a wall of {min(walls):.2f} mm beside a pin"
                shown = (outlines[part], holes[0])
                yield drawing.fault(what, part, shown, "laser.pin", "take thinner pins")
            for hole in holes:
                width = rectangle_sides(hole)[1]
                if abs(width - settings.laser.pin) > TOLERANCE:
                    what = f"a hole of {width:.3f} mm for pins of {settings.laser.pin:g} mm"
                    yield drawing.fault(what, part, (hole,), "laser.pin")
    yield from _check_count(record, "pin", found, "laser.pin")


def _check_dots(record: PackageRecord) -> Iterator[Fault]:
    """Checks that the templates have a hole for each dot of the bill, where the units want it."""
    found = 0
    for drawing in record.drawings.get(("template", NOMINAL), []):
        for part, curves in drawing.parts().items():
            holes = [curve.polygon for curve in curves if curve.layer == INNER and curve.closed]
            scored = [curve.line for curve in curves if curve.layer == SCORE]
            found += len(holes)
            yield from check_template(drawing, part, holes, scored)
    yield from _check_count(record, "dot", found, "markers")


def check_template(
    drawing: Drawing, part: str, holes: Sequence[Polygon], scored: Sequence[Geometry]
) -> Iterator[Fault]:
    """Checks holes against the scored outlines of units around them, where these are whole.

    Several dots of a unit lie about its centroid; one lies there too if there is room for it, and
    a small unit has none. A template that is split through units scores these by lines without a
    loop.
    """
    outlines, _, open_lines, _ = shapely.polygonize_full(list(scored))
    left = list(holes)
    for outline in shapely.get_parts(outlines):
        mine = [hole for hole in left if outline.intersects(hole)]
        left = [hole for hole in left if hole not in mine]
        if not mine:
            continue
        middle = shapely.multipoints([hole.centroid for hole in mine]).centroid
        within = all(outline.contains(hole) for hole in mine)
        off = middle.distance(outline.centroid)
        cramped = len(mine) == 1 and not outline.contains(_around(outline.centroid, mine[0]))
        if not within or (off > _OFF and not cramped):
            what = f"dots {off:.2f} mm off the middle of the unit that is scored around them"
            yield drawing.fault(what, part, (outline, *mine), "markers")
    if left and open_lines.is_empty:
        what = f"{len(left)} dots in no unit that is scored"
        yield drawing.fault(what, part, tuple(left), "markers")


def _around(centre: Point, hole: Polygon) -> Polygon:
    """Draws a hole about another centre, with the rim that it needs."""
    return centre.buffer(rectangle_sides(hole)[1] / 2 + _RIM)


def _check_count(record: PackageRecord, item: str, found: int, key: str) -> Iterator[Fault]:
    """Checks that the bill lists as many of an item as there are holes for it."""
    path = record.folder / BILL
    listed = sum(int(row["count"]) for row in read_bill(path) if row["item"] == item)
    if listed != found:
        what = f"{listed} {item}s for {found} holes"
        yield Fault("the bill of materials", what, key, BUG, path)


def _check_formats(drawing: Drawing, settings: Fabrication) -> Iterator[Fault]:
    """Checks that the same sheet as R12 and as SVG holds the same curves."""
    stem = drawing.file.stem
    for name in (f"{stem}_r12.dxf", f"{stem}.svg"):
        other = read_drawing(drawing.file.with_name(name))
        yield from check_form(other)
        yield from check_scale(other, settings.laser)
        if (what := _difference(drawing, other)) is not None:
            yield other.fault(what)


def _difference(one: Drawing, other: Drawing) -> str | None:
    """Compares two files of one sheet; one goes part by part, another layer by layer."""
    pairs = [sorted(drawing.curves, key=lambda curve: curve.layer) for drawing in (one, other)]
    ours, theirs = ([(c.part, c.layer, c.closed, len(c.tabs)) for c in cs] for cs in pairs)
    if ours != theirs:
        return f"other parts, layers or another order than in {one.file.name}"
    for mine, yours in zip(*pairs, strict=True):
        points, others = _compared(mine), _compared(yours)
        if len(points) != len(others) or np.abs(points - others).max(initial=0.0) >= TOLERANCE:
            return f"part {mine.part} has another size or place than in {one.file.name}"
    return None


def _compared(curve: Curve) -> Floats:
    """Selects the points to compare; circles and sheets may begin anywhere."""
    if curve.layer == REFERENCE or curve.kind == "CIRCLE":
        return np.stack([curve.points.min(axis=0), curve.points.max(axis=0)])
    return curve.points


def _check_kerfs(record: PackageRecord) -> Iterator[Fault]:
    """Checks that each kind of sheet is there for the set kerf, and its parts are larger."""
    variants = record.drawings
    for (kind, variant), nominal in variants.items():
        kerf = record.settings.kerf_of(kind)
        if variant != NOMINAL or kerf == 0.0:
            continue
        if (kind, name := f"kerf{kerf:g}") in variants:
            yield from check_compensation(variants[kind, name], nominal, kerf)
        else:
            what = f"there is no sheet of {kind} for a kerf of {kerf:g} mm"
            yield Fault("the drawings", what, "laser.kerf", BUG, nominal[0].file)
