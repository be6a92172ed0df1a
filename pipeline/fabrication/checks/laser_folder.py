"""Checks the folder laser/ as a whole: every format of every sheet, and all parts exactly once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from pipeline.fabrication.checks import bill_checks, sheet_checks
from pipeline.fabrication.checks import curve_checks as curves
from pipeline.fabrication.checks.assembled_specimen import check_outline
from pipeline.fabrication.checks.curve_checks import REFERENCE
from pipeline.fabrication.checks.expected_parts import every_unit
from pipeline.fabrication.checks.package_record import PackageRecord
from pipeline.fabrication.checks.sheet_checks import NOMINAL
from pipeline.fabrication.readback import BUG, Curve, Drawing, Fault, read_drawings
from pipeline.problem.sections import Fabrication


def check(record: PackageRecord) -> Iterator[Fault]:
    """Faults of all drawings in a package."""
    variants, asked = record.drawings, record.asked
    yield from _units(record)
    shims = variants.get(("shims", NOMINAL), [])
    yield from bill_checks.check_pieces(record.folder / bill_checks.NAME, shims)
    for drawing in (drawing for found in variants.values() for drawing in found):
        yield from curves.check(drawing)
        material = thickness(drawing.file, asked)
        yield from sheet_checks.check(drawing, asked.laser, material, record.letters)
        yield from _formats(drawing, asked)
    yield from _kerfs(variants, asked)


def thickness(file: Path, asked: Fabrication) -> float:
    """Of the material that a sheet is cut from, by the file's name."""
    foil = asked.shims.thickness
    kinds = {"units": asked.thickness, "coupon": asked.thickness, "shims": foil, "strips": foil}
    return kinds.get(file.name.partition("_")[0], asked.laser.template_thickness)


def _formats(drawing: Drawing, asked: Fabrication) -> Iterator[Fault]:
    """The same sheet as R12 and as SVG holds the same curves."""
    stem = drawing.file.stem
    for name in (f"{stem}_r12.dxf", f"{stem}.svg"):
        other = read_drawings.read(drawing.file.with_name(name))
        yield from curves.check_form(other)
        yield from sheet_checks.check_scale(other, asked.laser)
        if (what := _difference(drawing, other)) is not None:
            yield Fault("the drawing", what, "laser", BUG, other.file)


def _difference(one: Drawing, other: Drawing) -> str | None:
    """How two files of one sheet differ; one goes part by part, another layer by layer."""
    pairs = [sorted(drawing.curves, key=lambda curve: curve.layer) for drawing in (one, other)]
    ours, theirs = ([(c.part, c.layer, c.closed) for c in curves] for curves in pairs)
    if ours != theirs:
        return f"other parts, layers or another order than in {one.file.name}"
    for mine, yours in zip(*pairs, strict=True):
        if not _alike(mine, yours):
            return f"part {mine.part} has another size or place than in {one.file.name}"
    return None


def _alike(mine: Curve, yours: Curve) -> bool:
    """Whether two curves are the same; circles and sheets may begin anywhere."""
    pair = (mine.points, yours.points)
    if mine.kind == "CIRCLE" or mine.layer == REFERENCE:
        pair = (_box(mine), _box(yours))
    if len(pair[0]) != len(pair[1]):
        return False
    return bool(np.abs(pair[0] - pair[1]).max(initial=0.0) < sheet_checks.TOLERANCE)


def _box(curve: Curve) -> np.ndarray:
    return np.stack([curve.points.min(axis=0), curve.points.max(axis=0)])


def _kerfs(
    variants: Mapping[tuple[str, str], list[Drawing]], asked: Fabrication
) -> Iterator[Fault]:
    """Each kind of sheet is there for the kerf that was asked for, and its parts are larger."""
    kerf = asked.laser.kerf
    for (kind, variant), nominal in variants.items():
        if variant != NOMINAL or kerf == 0.0:
            continue
        if (kind, name := f"kerf{kerf:g}") in variants:
            yield from sheet_checks.compensation(variants[kind, name], nominal, kerf)
        else:
            what = f"there is no sheet of {kind} for a kerf of {kerf:g} mm"
            yield Fault("the drawings", what, "laser.kerf", BUG, nominal[0].file)


def _units(record: PackageRecord) -> Iterator[Fault]:
    """Each unit once, none that is not there, each true to its design."""
    units = record.drawings.get(("units", NOMINAL), [])
    found = [(part, shape, d.file) for d in units for part, shape in sheet_checks.outlines(d)]
    yield from every_unit(
        Counter(part for part, _, _ in found), record.wanted, record.folder / "laser"
    )
    for label, shape, file in found:
        if label in record.wanted.polygons:
            yield from check_outline(label, file, shape, record.found)
