"""Where the slots of a unit go: direction and depth of each, so that all walls are thick enough.

A slot starts out in the wanted direction at the wanted depth. Where walls would be too thin or
slots would meet, all slots of the unit are chosen together: the cheapest set of turns and depths
that leaves the walls. Only if there is none, the unit may grow a little beside its slots.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import Polygon

from pipeline.fabrication.parts import Slot
from pipeline.fabrication.units.slot_candidates import (
    Candidates,
    Corner,
    all_slots,
    best_wall,
    wanted_slot,
)
from pipeline.fabrication.units.slot_choice import distances, together
from pipeline.problem.sections import Fabrication

_KEPT = 600  # candidates per slot that are combined


class NoRoomError(ValueError):
    """The walls around the slots of a unit cannot be thick enough.

    Attributes:
        vertex: the corner where no slot at all fits, None if they only do not fit together.
        wall: thickest walls that were found there, mm.
    """

    def __init__(self, vertex: int | None, wall: float) -> None:
        super().__init__(f"no room for a slot at vertex {vertex}")
        self.vertex = vertex
        self.wall = wall


def place(
    polygon: Polygon, corners: Sequence[Corner], wanted: Fabrication, room: Polygon | None = None
) -> tuple[Slot, ...]:
    """The slots of a unit.

    Args:
        polygon: the unit as designed, mm, counter-clockwise.
        corners: the vertices that take a slot.
        wanted: how the specimen is made.
        room: what the unit may grow to, the polygon itself by default.

    Raises:
        NoRoomError: there are no slots with thick enough walls.
    """
    within = polygon if room is None else room
    direct = [wanted_slot(polygon, within, corner, wanted) for corner in corners]
    chosen = together(direct, wanted) if all(map(len, direct)) else None
    if chosen is None:
        chosen = _searched(polygon, within, corners, wanted)
    return _as_slots(corners, chosen, wanted)


def _searched(
    polygon: Polygon, room: Polygon, corners: Sequence[Corner], wanted: Fabrication
) -> list[Candidates]:
    offered = [all_slots(polygon, room, corner, wanted) for corner in corners]
    for corner, found in zip(corners, offered, strict=True):
        if not len(found):
            raise NoRoomError(corner.vertex, best_wall(polygon, room, corner, wanted))
    chosen = together([found.pick(np.arange(min(_KEPT, len(found)))) for found in offered], wanted)
    if chosen is None:
        raise NoRoomError(None, 0.0)
    return chosen


def _as_slots(
    corners: Sequence[Corner], chosen: Sequence[Candidates], wanted: Fabrication
) -> tuple[Slot, ...]:
    return tuple(
        Slot(
            corner.vertex,
            corner.ligament,
            found.mouth,
            found.direction[0],
            float(found.depth[0]),
            wanted.slot_width,
            float(found.truncation[0]),
            min([float(found.wall[0]), *_to_others(chosen, index, wanted)]),
        )
        for index, (corner, found) in enumerate(zip(corners, chosen, strict=True))
    )


def _to_others(chosen: Sequence[Candidates], index: int, wanted: Fabrication) -> list[float]:
    return [
        float(distances(chosen[index], other)[0, 0]) - wanted.slot_width
        for at, other in enumerate(chosen)
        if at != index
    ]
