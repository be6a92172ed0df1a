"""Where the slots of a unit go: direction and depth of each, so that all walls are thick enough.

A slot starts out in the wanted direction at the wanted depth. Where walls would be too thin or
slots would meet, all slots of the unit are chosen together: the cheapest set of turns and depths
that leaves the walls. Only if there is none, the unit may grow a little beside its slots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from pipeline.fabrication.parts import Floats, Slot
from pipeline.problem.fabrication import Fabrication

_TURNS = np.deg2rad(np.arange(-85.0, 86.0, 5.0))
_DEPTH_STEP = 0.25  # mm; few different lengths of shims
_KEPT = 600  # candidates per slot that are combined
_VISITS = 50_000  # choices looked at before the best so far is taken
_HAIR = 1e-6  # mm
_COST_OF_TURN = 1 / np.deg2rad(30.0)  # as dear as 1 mm less depth
_COST_OF_KINK = 1 / np.deg2rad(60.0)  # where the shim leaves the slot, against the ligament


@dataclass(frozen=True)
class Corner:
    """A vertex of a unit that takes a slot.

    Attributes:
        vertex: which vertex of the unit.
        ligament: id of the ligament there.
        along: (2,) unit vector of the ligament, pointing into the unit.
    """

    vertex: int
    ligament: int
    along: Floats


@dataclass(frozen=True)
class Candidates:
    """Possible slots at one corner.

    Attributes:
        mouth: (2,) the vertex.
        direction: (n, 2) unit vectors.
        depth, truncation, wall, cost: (n,).
    """

    mouth: Floats
    direction: Floats
    depth: Floats
    truncation: Floats
    wall: Floats
    cost: Floats

    def __len__(self) -> int:
        return len(self.depth)

    @property
    def ends(self) -> Floats:
        """(n, 2) inner ends."""
        return self.mouth + self.depth[:, None] * self.direction

    def pick(self, which: NDArray[np.int64] | NDArray[np.bool_]) -> Candidates:
        """Some of them."""
        return Candidates(
            self.mouth,
            *(
                values[which]
                for values in (self.direction, self.depth, self.truncation, self.wall, self.cost)
            ),
        )


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
    direct = [
        _candidates(polygon, within, corner, wanted, np.zeros(1), np.array([wanted.slots.depth]))
        for corner in corners
    ]
    chosen = _together(direct, wanted) if all(map(len, direct)) else None
    if chosen is None:
        chosen = _searched(polygon, within, corners, wanted)
    return _as_slots(corners, chosen, wanted)


def _searched(
    polygon: Polygon, room: Polygon, corners: Sequence[Corner], wanted: Fabrication
) -> list[Candidates]:
    slots = wanted.slots
    steps = np.arange(slots.depth_min, slots.depth_max + _HAIR, _DEPTH_STEP)
    depths = np.unique(np.append(steps, slots.depth))
    turns, depths = (grid.ravel() for grid in np.meshgrid(_TURNS, depths))
    offered = [_candidates(polygon, room, corner, wanted, turns, depths) for corner in corners]
    for corner, found in zip(corners, offered, strict=True):
        if not len(found):
            raise NoRoomError(corner.vertex, _best_wall(polygon, room, corner, wanted))
    chosen = _together(
        [found.pick(np.argsort(found.cost, kind="stable")[:_KEPT]) for found in offered], wanted
    )
    if chosen is None:
        raise NoRoomError(None, 0.0)
    return chosen


def _best_wall(polygon: Polygon, room: Polygon, corner: Corner, wanted: Fabrication) -> float:
    depths = np.arange(wanted.slots.depth_min, wanted.slots.depth_max + _HAIR, _DEPTH_STEP)
    turns, depths = (grid.ravel() for grid in np.meshgrid(_TURNS, depths))
    mouth, directions = _directions(polygon, corner, wanted, turns)
    walls = _walls(room, mouth, directions, depths, wanted.slot_width)
    return float(walls.max())


def _candidates(
    polygon: Polygon,
    room: Polygon,
    corner: Corner,
    wanted: Fabrication,
    turns: Floats,
    depths: Floats,
) -> Candidates:
    """Slots at a corner, turned by ``turns`` from the wanted direction, with thick enough walls."""
    mouth, directions = _directions(polygon, corner, wanted, turns)
    walls = _walls(room, mouth, directions, depths, wanted.slot_width)
    thick = walls >= wanted.minimum_wall - _HAIR
    directions, depths, walls, turns = (x[thick] for x in (directions, depths, walls, turns))
    truncation = truncations(room, mouth, directions, depths, wanted).max(axis=0)
    kink = np.arccos(np.clip(directions @ corner.along, -1.0, 1.0))
    cost = (
        np.abs(depths - wanted.slots.depth)
        + np.abs(turns) * _COST_OF_TURN
        + kink * _COST_OF_KINK
        + truncation
    )
    held = depths - truncation >= wanted.slots.depth_min - _HAIR
    return Candidates(mouth, directions, depths, truncation, walls, cost).pick(held)


def _directions(
    polygon: Polygon, corner: Corner, wanted: Fabrication, turns: Floats
) -> tuple[Floats, Floats]:
    """The vertex, and unit vectors (n, 2) turned from the wanted direction."""
    points = np.asarray(polygon.exterior.coords)[:-1]
    mouth = points[corner.vertex]
    ways = {
        "centroid": np.array([polygon.centroid.x, polygon.centroid.y]) - mouth,
        "ligament": corner.along,
        "bisector": _bisector(points, corner.vertex),
    }
    x, y = ways[wanted.slots.direction] / np.linalg.norm(ways[wanted.slots.direction])
    cosine, sine = np.cos(turns), np.sin(turns)
    return mouth, np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)


def _bisector(points: Floats, vertex: int) -> Floats:
    ahead = points[(vertex + 1) % len(points)] - points[vertex]
    behind = points[vertex - 1] - points[vertex]
    start = np.arctan2(ahead[1], ahead[0])
    inside = (np.arctan2(behind[1], behind[0]) - start) % (2 * np.pi)
    return np.array([np.cos(start + inside / 2), np.sin(start + inside / 2)])


def _walls(
    room: Polygon, mouth: Floats, directions: Floats, depths: Floats, width: float
) -> Floats:
    """(n,) thickness of the walls around the inner ends; negative where a slot leaves the unit."""
    ends = mouth + depths[:, None] * directions
    side = width / 2 * directions[:, ::-1] * [-1.0, 1.0]
    caps = shapely.linestrings(np.stack([ends - side, ends + side], axis=1))
    starts = np.broadcast_to(mouth, ends.shape) + 0.01 * directions
    cores = shapely.linestrings(np.stack([starts, ends], axis=1))
    shapely.prepare(room)
    inside = shapely.contains(room, caps) & shapely.contains(room, cores)
    return np.where(inside, shapely.distance(caps, room.exterior), -1.0)


def truncations(
    body: Polygon, mouth: Floats, directions: Floats, depths: Floats, wanted: Fabrication
) -> Floats:
    """(2, n) how far along slots the walls on their right and left are thinner than the tips.

    A wall is thick enough where the line beside the slot, a tip away, runs inside the body.
    """
    left = (wanted.slot_width / 2 + wanted.slots.tip) * directions[:, ::-1] * [-1.0, 1.0]
    starts = mouth + np.stack([-left, left])
    ends = starts + depths[:, None] * directions
    beside = shapely.linestrings(np.stack([starts, ends], axis=-2))
    pieces, owner = shapely.get_parts(shapely.intersection(beside.ravel(), body), return_index=True)
    reached = shapely.distance(pieces, shapely.points(ends.reshape(-1, 2)[owner])) < _HAIR
    length = np.zeros(beside.size)
    np.maximum.at(length, owner[reached], shapely.length(pieces[reached]))
    return np.maximum(depths - length.reshape(beside.shape), 0.0)


def side_truncations(body: Polygon, slot: Slot, wanted: Fabrication) -> tuple[float, float]:
    """The same for one slot of a body."""
    right, left = truncations(
        body, slot.mouth, slot.direction[None], np.array([slot.depth]), wanted
    )[:, 0]
    return float(right), float(left)


def _together(offered: Sequence[Candidates], wanted: Fabrication) -> list[Candidates] | None:
    """The cheapest choice of one candidate per corner whose slots keep their distance.

    Candidates come in ascending order of their cost. A choice strikes out what does not go with it
    at the corners after it, whose cheapest remaining candidates bound the cost.
    """
    least = wanted.minimum_wall + wanted.slot_width - _HAIR
    fits = {
        (a, b): _distances(offered[a], offered[b]) >= least
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
            after = [
                allowed & fits[corner, later][choice]
                for later, allowed in enumerate(left[1:], corner + 1)
            ]
            if (
                all(allowed.any() for allowed in after)
                and total
                + sum(
                    float(offered[later].cost[allowed.argmax()])
                    for later, allowed in enumerate(after, corner + 1)
                )
                < best[0]
            ):
                descend([*picked, choice], after, total)

    descend([], [np.ones(len(found), dtype=bool) for found in offered], 0.0)
    if not best[1] and offered:
        return None
    return [found.pick(np.array([at])) for found, at in zip(offered, best[1], strict=True)]


def _distances(one: Candidates, other: Candidates) -> Floats:
    """(n_one, n_other) distances of the centre lines of slots."""
    a0 = np.broadcast_to(one.mouth, one.ends.shape)[:, None]
    b0 = np.broadcast_to(other.mouth, other.ends.shape)[None]
    a1, b1 = one.ends[:, None], other.ends[None]
    apart = np.minimum.reduce(
        [
            _point_to_segment(a0, b0, b1),
            _point_to_segment(a1, b0, b1),
            _point_to_segment(b0, a0, a1),
            _point_to_segment(b1, a0, a1),
        ]
    )
    crossing = (_side(a0, a1, b0) * _side(a0, a1, b1) < 0) & (
        _side(b0, b1, a0) * _side(b0, b1, a1) < 0
    )
    return np.where(crossing, 0.0, apart)


def _side(start: Floats, end: Floats, point: Floats) -> Floats:
    along, to = end - start, point - start
    return along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0]


def _point_to_segment(point: Floats, start: Floats, end: Floats) -> Floats:
    along = end - start
    share = ((point - start) * along).sum(-1) / (along**2).sum(-1)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.linalg.norm(point - nearest, axis=-1)


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
        float(_distances(chosen[index], other)[0, 0]) - wanted.slot_width
        for at, other in enumerate(chosen)
        if at != index
    ]
