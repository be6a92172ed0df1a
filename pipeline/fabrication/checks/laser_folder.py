"""Checks the folder laser/ as a whole: every format of every sheet, and all parts exactly once."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.fabrication.checks.assembled_specimen import check_outline
from pipeline.fabrication.checks.bill_checks import check_shim_pieces
from pipeline.fabrication.checks.package_record import NOMINAL, PackageRecord
from pipeline.fabrication.checks.sheet_checks import (
    REFERENCE,
    TOLERANCE,
    check_compensation,
    check_curves,
    check_form,
    check_scale,
    check_sheet,
)
from pipeline.fabrication.papers import BILL
from pipeline.fabrication.readback import BUG, Curve, Drawing, Fault, read_drawing
from pipeline.problem.sections import Fabrication
from sim.core import Floats


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
    shims = variants.get(("shims", NOMINAL), [])
    yield from check_shim_pieces(record.folder / BILL, shims)
    for drawing in (drawing for sheets in variants.values() for drawing in sheets):
        yield from check_curves(drawing)
        yield from check_sheet(drawing, settings.laser, _thickness(drawing.file, settings))
        yield from _check_formats(drawing, settings)
    yield from _check_kerfs(record)


def _thickness(file: Path, settings: Fabrication) -> float:
    """Looks up the material that a sheet is cut from, by the file's name; mm."""
    foil = settings.shims.thickness
    kinds = {"units": settings.thickness, "coupon": settings.thickness}
    kinds |= {"shims": foil, "strips": foil}
    return kinds.get(file.name.partition("_")[0], settings.laser.template_thickness)


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
    ours, theirs = ([(c.part, c.layer, c.closed) for c in curves] for curves in pairs)
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
    kerf, variants = record.settings.laser.kerf, record.drawings
    for (kind, variant), nominal in variants.items():
        if variant != NOMINAL or kerf == 0.0:
            continue
        if (kind, name := f"kerf{kerf:g}") in variants:
            yield from check_compensation(variants[kind, name], nominal, kerf)
        else:
            what = f"there is no sheet of {kind} for a kerf of {kerf:g} mm"
            yield Fault("the drawings", what, "laser.kerf", BUG, nominal[0].file)
