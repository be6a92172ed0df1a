"""Checks the bill of materials: each unit once, and shims that fit the slots and the sheets."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from pipeline.fabrication.checks.package_record import PackageRecord
from pipeline.fabrication.checks.sheet_checks import rectangle_sides
from pipeline.fabrication.papers import BILL, read_bill
from pipeline.fabrication.parts import SHIM_PLAY
from pipeline.fabrication.readback import BUG, Drawing, Fault
from pipeline.fabrication.units import strip_between
from sim.core import Floats

_PLAY = 0.02  # mm by which measured slots may be deeper or shallower
_WRITTEN = 1e-3  # mm


def check_bill(record: PackageRecord) -> Iterator[Fault]:
    """Checks the bill: each unit once, a shim as long as each ligament takes, and spares."""
    path = record.folder / BILL
    rows = read_bill(path)
    units: Counter[str] = Counter()
    for row in rows:
        if row["item"] == "unit":
            units[row["id"]] += int(row["count"])
    yield from record.check_units(units, path)
    shims = [row for row in rows if row["item"] == "shim"]
    left = {row["id"]: int(row["count"]) for row in shims}
    cut = {row["id"]: float(row["length_mm"]) for row in shims}
    taken = {row["id"]: _shim_of(row) for row in rows if row["item"] == "ligament"}
    for number, length in _shim_lengths(record).items():
        shim = taken.get(str(number), "")
        if -_PLAY <= length - cut.get(shim, -np.inf) <= SHIM_PLAY + _PLAY:
            left[shim] -= 1
        else:
            what = f"its shim {shim} does not fit {length:.2f} mm from slot end to slot end"
            pair = " - ".join(label for label, _ in record.expected.joints[number])
            yield Fault(f"ligament {number}, {pair}", what, "slots.depth", BUG, path)
    for shim, spare in left.items():
        if spare < 1:
            what = f"{1 - spare} too few of shim {shim}, with one to spare"
            yield Fault("the bill of materials", what, "shims.spares", BUG, path)


def _shim_of(row: Mapping[str, str]) -> str:
    """Reads which shim a ligament takes, behind the units that it joins."""
    return row["note"].partition("; shim ")[2].partition(";")[0]


def _shim_lengths(record: PackageRecord) -> dict[int, float]:
    """Measures ligaments from slot end to slot end along the shim, mm, by their numbers."""
    held = {
        (label, slot.vertex): np.asarray(slot.held.coords)
        for label, slots in record.slots.items()
        for slot in slots
    }
    return {
        number: _along(*(held[end] for end in joint))
        for number, joint in record.expected.joints.items()
        if all(end in held for end in joint)
    }


def _along(first: Floats, second: Floats) -> float:
    """Measures a shim between two lines (2, 2) along which slots hold it, to their inner ends."""
    grips = [float(np.linalg.norm(line[1] - line[0])) for line in (first, second)]
    out, into = (line[at] - line[1 - at] for line, at in ((first, 0), (second, 1)))
    strip = strip_between(first[0], out / grips[0], second[0], into / grips[1])
    return strip.length + sum(grips)


def check_shim_pieces(path: Path, drawings: Sequence[Drawing]) -> Iterator[Fault]:
    """Checks the shims on their sheets: as many and as large as the bill at `path` says."""
    pieces: dict[str, list[tuple[float, float]]] = {}
    for part, outline in (found for drawing in drawings for found in drawing.outlines()):
        pieces.setdefault(part, []).append(rectangle_sides(outline))
    shims = {row["id"]: row for row in read_bill(path) if row["item"] == "shim"}
    for name in sorted(pieces.keys() | shims.keys()):
        sizes, row = pieces.get(name, []), shims.get(name)
        count = 0 if row is None else int(row["count"])
        what = f"{len(sizes)} on the sheets, {count} in the bill"
        if len(sizes) == count and row is not None:
            high, wide = sorted((float(row["length_mm"]), float(row["width_mm"])))
            if np.abs(np.subtract(sizes, (high, wide))).max() <= _WRITTEN:
                continue
            what = f"it is not {wide:.2f} x {high:.2f} mm on the sheets, as in the bill"
        yield Fault(f"shim {name}", what, "shims", BUG, path)
