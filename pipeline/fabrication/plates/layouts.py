"""Lays out flat parts on the sheets of a laser cutter, and solids on the plates of a printer."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon

from pipeline.fabrication.parts import Circle, FlatPart, PrintedPart
from pipeline.fabrication.plates.packing import Ground, spread
from pipeline.problem.sections import Laser, Print
from pipeline.runtime import UserError

MITRE = 5.0
"""Corners of cuts with the kerf made good reach at most so many offsets out."""

_SHORT = 1e-4  # mm; shorter edges are left out, narrower slots are closed
_FILLED = 0.2  # mm^2 that a kerf may fill, in narrow corners


@dataclass(frozen=True)
class LaserSheet:
    """Holds a sheet with parts on it."""

    name: str  # of its files, such as "units_sheet1_kerf0.15"
    size: tuple[float, float]  # width and height, mm
    parts: tuple[FlatPart, ...]  # in the order in which they are cut, where they lie on the sheet


def laser_sheets(
    kind: str, parts: Sequence[FlatPart], settings: Laser, file: str
) -> Iterator[LaserSheet]:
    """Lays out one kind of parts: at nominal size, then with the kerf made good if there is one.

    The kind begins the names of the files; `file` is that of the problem, for messages.

    Raises:
        UserError: a part is larger than a sheet, or too fine for the kerf.
    """
    ground = Ground("sheet", "laser", settings.sheet, settings.margin, settings.gap)
    for kerf in dict.fromkeys((0.0, settings.kerf)):
        drawn = [compensated(part, kerf, file) for part in parts]
        variant = f"kerf{kerf:g}" if kerf else "nominal"
        for number, placed in enumerate(spread(drawn, ground, file), 1):
            moved = tuple(part.moved(x, y) for part, x, y in placed)
            yield LaserSheet(f"{kind}_sheet{number}_{variant}", settings.sheet, moved)


def compensated(part: FlatPart, kerf: float, file: str) -> FlatPart:
    """Offsets the outer cut of a part by half a kerf outwards and its holes inwards.

    Of a tab as much is left as asked for: the laser stops half a kerf before it.

    Raises:
        UserError: a slot or a hole is narrower than the kerf.
    """
    if kerf == 0.0:
        return part
    grown = part.outline.buffer(kerf / 2, join_style="mitre", mitre_limit=MITRE)
    simple = isinstance(grown, Polygon) and len(grown.interiors) == 0
    filled = grown.buffer(-kerf / 2, join_style="mitre").difference(part.outline).area
    narrow = part.slot <= kerf + _SHORT
    if narrow or not simple or filled > _FILLED or any(h.diameter <= kerf for h in part.holes):
        closed = f"a slot of {part.slot:g} mm" if narrow else "a slot or a hole"
        what = f"a kerf of {kerf:g} mm closes {closed} of part {part.id}"
        remedy = "lower it, or raise fabrication.slots.clearance and those of fabrication.coupon"
        remedy += "; with a smaller fabrication.laser.aspect_ratio units are printed only"
        if part.holes and np.isinf(part.slot):  # of the template
            remedy = "lower it, or ask for larger dots (fabrication.markers.diameter)"
        raise UserError(what, file=file, key="fabrication.laser.kerf", remedy=remedy)
    outline = shapely.orient_polygons(grown.simplify(_SHORT))
    holes = tuple(Circle(hole.centre, hole.diameter - kerf) for hole in part.holes)
    tabs = tuple(Circle(tab.centre, tab.diameter + kerf) for tab in part.tabs)
    return replace(part, outline=outline, holes=holes, tabs=tabs)


def print_plates(
    kind: str, solids: Sequence[PrintedPart], settings: Print, file: str
) -> Iterator[tuple[str, tuple[tuple[PrintedPart, float, float], ...]]]:
    """Lays out one kind of parts on plates: their names, and the corners of the parts' boxes, mm.

    The kind begins the names of the files; `file` is that of the problem, for messages.

    Raises:
        UserError: a part is larger than the bed.
    """
    bed = Ground("bed", "print", settings.bed, settings.margin, settings.gap)
    for number, parts in enumerate(spread(solids, bed, file), 1):
        yield f"{kind}_plate{number}", parts
