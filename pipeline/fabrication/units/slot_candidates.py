"""Possible slots at one corner of a unit: how thick their walls are, how dear they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from pipeline.fabrication.parts import Slot
from pipeline.problem.sections import Fabrication
from sim.core import Floats

_TURNS = np.deg2rad(np.arange(-85.0, 86.0, 5.0))
_DEPTH_STEP = 0.25  # mm; few different lengths of shims
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


def wanted_slot(polygon: Polygon, room: Polygon, corner: Corner, wanted: Fabrication) -> Candidates:
    """The slot in the wanted direction at the wanted depth, if its walls are thick enough."""
    depth = np.array([wanted.slots.depth])
    return _candidates(polygon, room, corner, wanted, np.zeros(1), depth)


def all_slots(polygon: Polygon, room: Polygon, corner: Corner, wanted: Fabrication) -> Candidates:
    """Slots of all directions and depths whose walls are thick enough, the cheapest first."""
    found = _candidates(polygon, room, corner, wanted, *_turns_and_depths(wanted))
    return found.pick(np.argsort(found.cost, kind="stable"))


def best_wall(polygon: Polygon, room: Polygon, corner: Corner, wanted: Fabrication) -> float:
    """The thickest walls of any slot at a corner, mm; negative if none stays inside."""
    turns, depths = _turns_and_depths(wanted)
    mouth, directions = _directions(polygon, corner, wanted, turns)
    walls = _walls(room, mouth, directions, depths, wanted.slot_width)
    return float(walls.max())


def _turns_and_depths(wanted: Fabrication) -> tuple[Floats, Floats]:
    slots = wanted.slots
    steps = np.arange(slots.depth_min, slots.depth_max + _HAIR, _DEPTH_STEP)
    depths = np.unique(np.append(steps, slots.depth))
    turns, depths = (grid.ravel() for grid in np.meshgrid(_TURNS, depths))
    return turns, depths


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

    That is as far as the band beside the slot, as wide as a tip, reaches out of the body.
    """
    left = directions[:, ::-1] * [-1.0, 1.0]
    near, far = wanted.slot_width / 2, wanted.slot_width / 2 + wanted.slots.tip
    inwards = depths[:, None] * directions
    starts = [np.stack([-side * left, side * left]) + mouth for side in (near, far)]
    rings = np.stack([starts[0], starts[1], starts[1] + inwards, starts[0] + inwards], axis=-2)
    outside = shapely.difference(shapely.polygons(rings).ravel(), body)
    points, owner = shapely.get_coordinates(outside, return_index=True)
    along = ((points - mouth) * np.tile(directions, (2, 1))[owner]).sum(axis=-1)
    cut = np.zeros(len(outside))
    np.maximum.at(cut, owner, along)
    return cut.reshape(2, -1)


def side_truncations(body: Polygon, slot: Slot, wanted: Fabrication) -> tuple[float, float]:
    """The same for one slot of a body."""
    right, left = truncations(
        body, slot.mouth, slot.direction[None], np.array([slot.depth]), wanted
    )[:, 0]
    return float(right), float(left)
