"""Places the slots of a unit: direction and depth of each, so that all walls are thick enough.

A slot starts out in the preferred direction at the preferred depth. Where walls would be too thin,
slots would meet, or the shim comes out of its other slot at an angle, all slots of the unit are
chosen together: the cheapest set of turns and depths that leaves the walls, where a shim that is
bent before any load is dear. Only if there is none, the unit may grow a little beside its slots.
"""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Polygon

from pipeline.fabrication.parts import Slot
from pipeline.fabrication.units.slot_candidates import (
    Candidates,
    Corner,
    all_slots,
    best_wall,
    preferred_slot,
)
from pipeline.problem.sections import Fabrication

_FEW, _KEPT = 60, 600  # candidates per slot that are combined at first, and at most
_VISITS = 50_000  # choices looked at before the best so far is taken
_HAIR = 1e-6  # mm


class NoRoomError(ValueError):
    """Reports that the walls around the slots of a unit cannot be thick enough."""

    def __init__(self, vertex: int | None, wall: float) -> None:
        super().__init__(f"no room for a slot at vertex {vertex}")
        self.vertex = vertex  # where no slot at all fits; None if they only do not fit together
        self.wall = wall  # thickest walls possible there, mm


def place_slots(
    polygon: Polygon, corners: Sequence[Corner], settings: Fabrication, room: Polygon
) -> tuple[Slot, ...]:
    """Places the slots of a unit.

    Args:
        polygon: the unit as designed, mm, counter-clockwise.
        corners: the vertices that take a slot.
        settings: depths, directions and walls of slots.
        room: the polygon itself, or the area that the unit may grow to.

    Raises:
        NoRoomError: there are no slots with thick enough walls.
    """
    chosen = None
    if settings.slots.direction != "ligament" or all(corner.straight for corner in corners):
        direct = [preferred_slot(polygon, room, corner, settings) for corner in corners]
        chosen = _cheapest_choice(direct, settings) if all(map(len, direct)) else None
    if chosen is None:
        offered = [all_slots(polygon, room, corner, settings) for corner in corners]
        for corner, candidates in zip(corners, offered, strict=True):
            if not len(candidates):
                raise NoRoomError(corner.vertex, best_wall(polygon, room, corner, settings))
        chosen = _cheapest_of_many(offered, settings)
    if chosen is None:
        raise NoRoomError(None, 0.0)
    lines = [candidates.lines[0] for candidates in chosen]
    return tuple(
        Slot(
            corner.vertex,
            corner.ligament,
            one.mouth,
            one.direction[0],
            float(one.depth[0]),
            settings.slot_width,
            float(one.truncation[0]),
            min(float(one.wall[0]), _clearance(lines, at) - settings.slot_width),
        )
        for at, (corner, one) in enumerate(zip(corners, chosen, strict=True))
    )


def _clearance(lines: Sequence[LineString], at: int) -> float:
    """Measures the distance from one centre line to the nearest other one, mm."""
    others = shapely.MultiLineString([*lines[:at], *lines[at + 1 :]])
    return float(others.distance(lines[at])) if len(lines) > 1 else np.inf


def _cheapest_of_many(
    offered: Sequence[Candidates], settings: Fabrication
) -> list[Candidates] | None:
    """Chooses as `_cheapest_choice`, first among the cheapest few of each corner.

    What is dearer than a choice of these less the cheapest of all other corners cannot improve it.
    """
    few = _cheapest_choice([one.pick(slice(_FEW)) for one in offered], settings)
    kept = [one.pick(slice(_KEPT)) for one in offered]
    if few is not None:
        least = [float(one.cost[0]) for one in offered]
        margin = sum(float(one.cost[0]) for one in few) - sum(least)
        kept = [one.pick(one.cost <= low + margin) for one, low in zip(kept, least, strict=True)]
        if max(map(len, kept), default=0) <= _FEW:
            return few
    return _cheapest_choice(kept, settings)


def _cheapest_choice(
    offered: Sequence[Candidates], settings: Fabrication
) -> list[Candidates] | None:
    """Chooses the cheapest candidate per corner such that slots keep their distance.

    Candidates come in ascending order of their cost. A choice strikes out what does not go with it
    at the corners after it, whose cheapest remaining candidates bound the cost.
    """
    least = settings.minimum_wall + settings.slot_width - _HAIR
    fits = {
        (a, b): ~shapely.dwithin(offered[a].lines[:, None], offered[b].lines[None], least)
        for b in range(len(offered))
        for a in range(b)
    }
    best: tuple[float, list[int]] = (np.inf, [])
    visits = _VISITS

    def descend(picked: list[int], left: list[NDArray[np.bool_]], cost: float) -> None:
        nonlocal best, visits
        corner = len(picked)
        if corner == len(offered):
            best = (cost, picked)
            return
        for choice in np.flatnonzero(left[0]).tolist():
            total = cost + float(offered[corner].cost[choice])
            if total >= best[0] or visits == 0:
                return
            visits -= 1
            later = range(corner + 1, len(offered))
            after = [
                allowed & fits[corner, other][choice]
                for other, allowed in zip(later, left[1:], strict=True)
            ]
            if not all(allowed.any() for allowed in after):
                continue
            rest = zip(later, after, strict=True)
            bound = sum(float(offered[other].cost[allowed.argmax()]) for other, allowed in rest)
            if total + bound < best[0]:
                descend([*picked, choice], after, total)

    descend([], [np.ones(len(candidates), dtype=bool) for candidates in offered], 0.0)
    if not best[1] and offered:
        return None
    return [one.pick(slice(at, at + 1)) for one, at in zip(offered, best[1], strict=True)]
