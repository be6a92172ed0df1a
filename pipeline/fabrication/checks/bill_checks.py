"""Checks the bill of materials: each unit once, and shims that fit the slots and the sheets."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from shapely import Polygon

from pipeline.fabrication.checks import sheet_checks, slot_checks
from pipeline.fabrication.checks.assembled_specimen import Shapes
from pipeline.fabrication.checks.expected_parts import Wanted, every_unit
from pipeline.fabrication.checks.package_record import PackageRecord
from pipeline.fabrication.readback import BUG, Drawing, Fault
from pipeline.problem.sections import Fabrication
from pipeline.runtime import UserError

Row = Mapping[str, str]

NAME = "bom.csv"

_PLAY = 0.02  # mm that a shim may be longer or shorter than from slot end to slot end
_WRITTEN = 1e-3  # mm


def rows(path: Path) -> list[dict[str, str]]:
    """The lines of the bill of materials.

    Raises:
        UserError: it cannot be read.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file, strict=True))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        what = f"the bill of materials that was just written cannot be read back: {error}"
        raise UserError(what, file=path, remedy=BUG) from error


def check(record: PackageRecord) -> Iterator[Fault]:
    """Faults of the bill: each unit once, a shim as long as each ligament takes, and spares."""
    path, wanted = record.folder / NAME, record.wanted
    listed = rows(path)
    units: Counter[str] = Counter()
    for row in listed:
        if row["item"] == "unit":
            units[row["id"]] += int(row["count"])
    yield from every_unit(units, wanted, path)
    shims = [row for row in listed if row["item"] == "shim"]
    left = {row["id"]: int(row["count"]) for row in shims}
    for pair, length in _lengths(wanted, record.found, record.asked):
        fits = [row["id"] for row in shims if abs(float(row["length_mm"]) - length) < _PLAY]
        if not fits:
            what = f"no shim is {length:.2f} mm long, from slot end to slot end"
            yield Fault(f"ligament {' - '.join(pair)}", what, "slots.depth", BUG, path)
        for shim in fits[:1]:
            left[shim] -= 1
    for shim, spare in left.items():
        if spare < 1:
            what = f"{1 - spare} too few of shim {shim}, with one to spare"
            yield Fault("the bill of materials", what, "shims.spares", BUG, path)


def _lengths(
    wanted: Wanted, found: Shapes, asked: Fabrication
) -> Iterator[tuple[tuple[str, str], float]]:
    """Labels at the ends of ligaments, and from slot end to slot end along the shim, mm."""
    depths = {
        (label, slot.vertex): slot.depth
        for label, made in found.items()
        if isinstance(made, Polygon)
        for slot in slot_checks.slots(wanted.polygons[label], made, asked.slot_width)
    }
    for joint in wanted.joints:
        if all(end in depths for end in joint):
            mouths = [wanted.polygons[label].exterior.coords[vertex] for label, vertex in joint]
            gap = float(np.linalg.norm(np.subtract(*mouths)))
            (one, _), (other, _) = joint
            yield (one, other), gap + sum(depths[end] for end in joint)


def check_pieces(path: Path, drawings: list[Drawing]) -> Iterator[Fault]:
    """Faults of the shims on their sheets: as many and as large as the bill tells."""
    pieces: dict[str, list[tuple[float, float]]] = {}
    for drawing in drawings:
        for part, outline in sheet_checks.outlines(drawing):
            size = (sheet_checks.widest(outline), sheet_checks.narrowest(outline))
            pieces.setdefault(part, []).append(size)
    shims = {row["id"]: row for row in rows(path) if row["item"] == "shim"}
    for name in sorted(pieces.keys() | shims.keys()):
        if (what := _unlike(pieces.get(name, []), shims.get(name))) is not None:
            yield Fault(f"shim {name}", what, "shims", BUG, path)


def _unlike(pieces: list[tuple[float, float]], row: Row | None) -> str | None:
    """How pieces on sheets differ from a line of the bill."""
    count = 0 if row is None else int(row["count"])
    if len(pieces) != count or row is None:
        return f"{len(pieces)} on the sheets, {count} in the bill"
    size = sorted((float(row["length_mm"]), float(row["width_mm"])), reverse=True)
    if np.abs(np.subtract(pieces, size)).max() > _WRITTEN:
        return f"it is not {size[0]:.2f} x {size[1]:.2f} mm on the sheets, as in the bill"
    return None
