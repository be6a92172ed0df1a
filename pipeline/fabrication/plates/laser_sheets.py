"""Flat parts on sheets for the laser cutter, at nominal size or with the kerf made good."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import shapely
from shapely import Polygon

from pipeline.fabrication.parts import Circle, FlatPart
from pipeline.fabrication.plates.packing import Ground, spread
from pipeline.problem.sections import Laser
from pipeline.runtime import UserError

_MITRE = 5.0
_SHORT = 1e-4  # mm; shorter edges are left out
_FILLED = 0.2  # mm^2 that a kerf may fill, in narrow corners


@dataclass(frozen=True)
class LaserSheet:
    """A sheet with parts on it.

    Attributes:
        name: of its files, such as "units_sheet1_kerf0.15".
        size: width and height.
        kerf: that the cuts make good; 0 for nominal size.
        parts: in the order in which they are cut, where they lie on the sheet.
    """

    name: str
    size: tuple[float, float]
    kerf: float
    parts: tuple[FlatPart, ...]

    @property
    def ids(self) -> list[str]:
        """Ids of the parts."""
        return [part.id for part in self.parts]


def sheets(kind: str, parts: Sequence[FlatPart], wanted: Laser, file: str) -> Iterator[LaserSheet]:
    """The sheets of one kind of parts: at nominal size, then with the kerf if there is one.

    Args:
        kind: what they hold; begins the names of the files.
        parts: the parts.
        wanted: sheet, kerf, margin, gap.
        file: of the problem, for messages.

    Raises:
        UserError: a part is larger than a sheet, or too fine for the kerf.
    """
    ground = Ground("sheet", "laser", wanted.sheet, wanted.margin, wanted.gap)
    for kerf in dict.fromkeys((0.0, wanted.kerf)):
        drawn = [compensated(part, kerf, file) for part in parts]
        variant = f"kerf{kerf:g}" if kerf else "nominal"
        for number, placed in enumerate(spread(drawn, ground, file), 1):
            moved = tuple(part.moved(x, y) for part, x, y in placed)
            yield LaserSheet(f"{kind}_sheet{number}_{variant}", wanted.sheet, kerf, moved)


def compensated(part: FlatPart, kerf: float, file: str) -> FlatPart:
    """The part with its outer cut half a kerf outwards and its holes half a kerf inwards.

    Raises:
        UserError: a slot or a hole is narrower than the kerf.
    """
    if kerf == 0.0:
        return part
    grown = part.outline.buffer(kerf / 2, join_style="mitre", mitre_limit=_MITRE)
    whole = isinstance(grown, Polygon) and len(grown.interiors) == 0
    filled = grown.buffer(-kerf / 2, join_style="mitre").difference(part.outline).area
    if not whole or filled > _FILLED or any(hole.diameter <= kerf for hole in part.holes):
        what = f"a kerf of {kerf:g} mm closes a slot or a hole of part {part.id}"
        remedy = "lower it, or raise fabrication.slots.clearance and those of fabrication.coupon"
        raise UserError(what, file=file, key="fabrication.laser.kerf", remedy=remedy)
    outline = shapely.orient_polygons(grown.simplify(_SHORT))
    holes = tuple(Circle(hole.centre, hole.diameter - kerf) for hole in part.holes)
    return replace(part, outline=outline, holes=holes)
