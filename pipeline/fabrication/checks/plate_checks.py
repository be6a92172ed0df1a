"""Checks what stands on a printer's plate: parts on the bed, apart, named, flat on z = 0."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely import Geometry

from pipeline.fabrication.checks.sheet_checks import closest
from pipeline.fabrication.readback import BUG, TOLERANCE, Fault, MeshBody, check
from pipeline.problem.sections import Print

_CUT = 0.5  # of its height: where a part's footprint is taken


def check_plate(plate: Sequence[MeshBody], printer: Print) -> Iterator[Fault]:
    """Faults of the objects of one plate."""
    faults = [fault for solid in plate for fault in check(solid)]
    yield from faults
    if faults:  # what is no solid has no footprint
        return
    yield from _names(plate)
    footprints = np.array([footprint(solid) for solid in plate])
    yield from _on_bed(plate, footprints, printer)
    for first, second, gap in closest(footprints, printer.gap - TOLERANCE):
        what = f"{gap:.3f} mm from part {plate[second].name}, less than {printer.gap:g} mm"
        yield _fault(plate[first], what, "print.gap", footprints[[first, second]])


def footprint(solid: MeshBody) -> Geometry:
    """What a part covers of the bed, seen from the top."""
    low, high = solid.extent
    heights = low[2] + (high[2] - low[2]) * np.array([0.02, _CUT, 0.98])
    return shapely.union_all([solid.section(float(height)) for height in heights])


def _names(plate: Sequence[MeshBody]) -> Iterator[Fault]:
    seen: set[str] = set()
    for solid in plate:
        if not solid.name:
            yield _fault(solid, "an object without a name", "print", np.array([]))
        elif solid.name in seen:
            yield _fault(solid, "two objects of this name", "print", np.array([]))
        seen.add(solid.name)


def _on_bed(plate: Sequence[MeshBody], footprints: np.ndarray, printer: Print) -> Iterator[Fault]:
    room = shapely.box(0.0, 0.0, *printer.bed).buffer(-printer.margin, join_style="mitre")
    for solid, shape in zip(plate, footprints, strict=True):
        if not room.buffer(TOLERANCE).covers(shape):
            what = f"it does not stand on the bed less its margin of {printer.margin:g} mm"
            yield _fault(solid, what, "print.bed", np.array([shape, room]))


def _fault(solid: MeshBody, what: str, key: str, shown: np.ndarray) -> Fault:
    around = tuple(shown)
    spot = around[0] if around else None
    return Fault(f"part {solid.name}", what, key, BUG, solid.file, around, spot)
