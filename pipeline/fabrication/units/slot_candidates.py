"""Lists possible slots at one corner of a unit, with their walls and their costs."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from pipeline.fabrication.parts import Slot
from pipeline.fabrication.units.prebend import peak_curvature
from pipeline.problem.sections import Fabrication
from sim.constraints import slot_depth
from sim.core import Floats, Ints
from sim.structure import angle_between

_slot_depth = jax.jit(slot_depth, static_argnums=0)
_TURNS = np.deg2rad(np.arange(-85.0, 86.0, 5.0))
_DEPTH_STEP = 0.25  # mm; few different lengths of shims
_HAIR = 1e-6  # mm
_COST_OF_TURN = 1 / np.deg2rad(30.0)  # as dear as 1 mm less depth
_DEAR_STRAIN = 0.002  # of the shim before any load: as dear as 1 mm less depth; its square counts
_STRAIGHT = np.deg2rad(0.01)


@dataclass(frozen=True)
class Corner:
    """Marks a vertex of a unit that takes a slot."""

    vertex: int
    ligament: int  # id of the ligament there
    along: Floats  # (2,) unit vector of the ligament, pointing into the unit
    length: float  # of the ligament, mm
    turn: float | None = None  # of the slot against the ligament, rad, if designed; None if free
    other: Slot | None = None  # at the ligament's other end, once there is one

    @property
    def straight(self) -> bool:
        """Tests that a slot along the ligament leaves the shim straight, as far as is known."""
        other = self.other
        return other is None or abs(angle_between(-self.along, other.direction)) < _STRAIGHT


@dataclass(frozen=True)
class Candidates:
    """Holds possible slots at one corner."""

    mouth: Floats  # (2,) the vertex
    direction: Floats  # (n, 2) unit vectors
    depth: Floats  # (n,)
    truncation: Floats  # likewise
    wall: Floats  # likewise
    cost: Floats  # likewise

    def __len__(self) -> int:
        return len(self.depth)

    @property
    def lines(self) -> NDArray[np.object_]:
        """(n,) centre lines, from the mouth to the inner end."""
        ends = self.mouth + self.depth[:, None] * self.direction
        return shapely.linestrings(
            np.stack([np.broadcast_to(self.mouth, ends.shape), ends], axis=1)
        )

    def pick(self, which: slice | Ints | NDArray[np.bool_]) -> Candidates:
        """Selects some of them."""
        values = (self.direction, self.depth, self.truncation, self.wall, self.cost)
        return Candidates(self.mouth, *(value[which] for value in values))


def preferred_slot(
    polygon: Polygon, room: Polygon, corner: Corner, settings: Fabrication
) -> Candidates:
    """Offers the slot in the preferred direction and depth, if its walls are thick enough."""
    turn, depth = np.full(1, corner.turn or 0.0), np.array([settings.slots.depth])
    return _candidates(polygon, room, corner, settings, turn, depth)


def all_slots(polygon: Polygon, room: Polygon, corner: Corner, settings: Fabrication) -> Candidates:
    """Offers slots of all directions and depths with thick enough walls, the cheapest first."""
    turns_and_depths = _turns_and_depths(polygon, corner, settings)
    offered = _candidates(polygon, room, corner, settings, *turns_and_depths)
    return offered.pick(np.argsort(offered.cost, kind="stable"))


def best_wall(polygon: Polygon, room: Polygon, corner: Corner, settings: Fabrication) -> float:
    """Measures the thickest walls of any slot at a corner, mm; negative if none stays inside."""
    turns, depths = _turns_and_depths(polygon, corner, settings)
    mouth, directions = _directions(polygon, corner, settings, turns)
    return float(_walls(room, mouth, directions, depths, settings.slot_width).max())


def _turns_and_depths(
    polygon: Polygon, corner: Corner, settings: Fabrication
) -> tuple[Floats, Floats]:
    """Lists turns and depths to try, also along the ways that slots may be asked to point."""
    slots = settings.slots
    depths = np.unique([*_depths(settings), _designed_depth(polygon, corner, settings)])
    _, ways = _slot_directions(polygon, corner)
    exact = [angle_between(ways[slots.direction], way) for way in ways.values()]
    offered = np.unique(np.round([*_TURNS, *exact], 6)) if corner.turn is None else corner.turn
    turns, depths = np.meshgrid(offered, depths)
    return turns.ravel(), depths.ravel()


def _depths(settings: Fabrication) -> Floats:
    """Lists the depths of few different shims."""
    slots = settings.slots
    steps = np.arange(slots.depth_min, slots.depth_max + _HAIR, _DEPTH_STEP)
    return np.append(steps, slots.depth)


def _designed_depth(polygon: Polygon, corner: Corner, settings: Fabrication) -> float:
    """Computes the depth that a design with straight shims, or with turned slots, has room for."""
    points = np.asarray(polygon.exterior.coords)[:-1]
    behind, here, ahead = (points[(corner.vertex + k) % len(points)] for k in (-1, 0, 1))
    along = _turned(corner.along, np.array([corner.turn or 0.0]))[0]
    return float(_slot_depth(settings.slot_room, along, behind - here, ahead - here))


def _candidates(
    polygon: Polygon,
    room: Polygon,
    corner: Corner,
    settings: Fabrication,
    turns: Floats,
    depths: Floats,
) -> Candidates:
    """Offers slots turned by ``turns`` from the preferred direction, with thick enough walls."""
    mouth, directions = _directions(polygon, corner, settings, turns)
    walls = _walls(room, mouth, directions, depths, settings.slot_width)
    thick = walls >= settings.minimum_wall - _HAIR
    directions, depths, walls, turns = (x[thick] for x in (directions, depths, walls, turns))
    truncation = truncations(room, mouth, directions, depths, settings).max(axis=0)
    cost = np.abs(depths - settings.slots.depth) + truncation
    cost += np.where(np.isin(depths, _depths(settings)), 0.0, _DEPTH_STEP)
    cost += (_strains(mouth, directions, truncation, corner, settings) / _DEAR_STRAIN) ** 2
    if settings.slots.direction != "ligament":
        cost += np.abs(turns) * _COST_OF_TURN
    held = depths - truncation >= settings.slots.depth_min - _HAIR
    return Candidates(mouth, directions, depths, truncation, walls, cost).pick(held)


def _strains(
    mouth: Floats, directions: Floats, truncation: Floats, corner: Corner, settings: Fabrication
) -> Floats:
    """Computes the strains (n,) of the shim in slots, before any load.

    As long as there is no slot at the other end, the shim is taken to leave along the ligament.
    """
    other = corner.other
    end = mouth - corner.length * corner.along if other is None else other.held
    enters = -corner.along if other is None else other.direction
    start = mouth + truncation[:, None] * directions
    return settings.shims.thickness / 2.0 * peak_curvature(start, -directions, end, enters)


def _slot_directions(polygon: Polygon, corner: Corner) -> tuple[Floats, dict[str, Floats]]:
    """Finds the vertex, and vectors along which a slot may be asked to point."""
    points = np.asarray(polygon.exterior.coords)[:-1]
    mouth = points[corner.vertex]
    return mouth, {
        "centroid": np.array([polygon.centroid.x, polygon.centroid.y]) - mouth,
        "ligament": corner.along,
        "bisector": _bisector(points, corner.vertex),
    }


def _directions(
    polygon: Polygon, corner: Corner, settings: Fabrication, turns: Floats
) -> tuple[Floats, Floats]:
    """Finds the vertex, and unit vectors (n, 2) turned from the preferred direction."""
    mouth, ways = _slot_directions(polygon, corner)
    way = ways["ligament" if corner.turn is not None else settings.slots.direction]
    return mouth, _turned(way / np.linalg.norm(way), turns)


def _turned(way: Floats, turns: Floats) -> Floats:
    """Turns a vector (2,) by angles (n,), rad, counter-clockwise; returns (n, 2)."""
    cosine, sine = np.cos(turns), np.sin(turns)
    x, y = way
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)


def _bisector(points: Floats, vertex: int) -> Floats:
    ahead = points[(vertex + 1) % len(points)] - points[vertex]
    behind = points[vertex - 1] - points[vertex]
    start = np.arctan2(ahead[1], ahead[0])
    inside = (np.arctan2(behind[1], behind[0]) - start) % (2 * np.pi)
    return np.array([np.cos(start + inside / 2), np.sin(start + inside / 2)])


def _walls(
    room: Polygon, mouth: Floats, directions: Floats, depths: Floats, width: float
) -> Floats:
    """Measures walls (n,) around the inner ends; negative where a slot leaves the unit."""
    ends = mouth + depths[:, None] * directions
    side = width / 2 * directions[:, ::-1] * [-1.0, 1.0]
    caps = shapely.linestrings(np.stack([ends - side, ends + side], axis=1))
    starts = np.broadcast_to(mouth, ends.shape) + 0.01 * directions
    cores = shapely.linestrings(np.stack([starts, ends], axis=1))
    shapely.prepare(room)
    inside = np.flatnonzero(shapely.contains(room, caps))
    inside = inside[shapely.contains(room, cores[inside])]
    walls = np.full(len(caps), -1.0)
    walls[inside] = shapely.distance(caps[inside], room.exterior)
    return walls


def truncations(
    body: Polygon, mouth: Floats, directions: Floats, depths: Floats, settings: Fabrication
) -> Floats:
    """Measures (2, n) how far along slots the walls on right and left are thinner than the tips.

    That is as far as the band beside the slot, as wide as a tip, reaches out of the body. Slots of
    one direction share the band of the deepest: a piece of it that is out of the body reaches as
    far as its end, or as the slot if that ends within the piece.
    """
    ways, way = np.unique(directions, axis=0, return_inverse=True)
    deepest = np.zeros(len(ways))
    np.maximum.at(deepest, way, depths)
    left = ways[:, ::-1] * [-1.0, 1.0]
    near, far = settings.slot_width / 2, settings.slot_width / 2 + settings.slots.tip
    inwards = deepest[:, None] * ways
    starts = [np.stack([-side * left, side * left]) + mouth for side in (near, far)]
    rings = np.stack([starts[0], starts[1], starts[1] + inwards, starts[0] + inwards], axis=-2)
    outside = shapely.difference(shapely.polygons(rings).ravel(), body)
    pieces, band = shapely.get_parts(outside, return_index=True)
    points, piece = shapely.get_coordinates(pieces, return_index=True)
    along = ((points - mouth) * ways[band[piece] % len(ways)]).sum(axis=-1)
    begins, ends = np.full(len(pieces), np.inf), np.full(len(pieces), -np.inf)
    np.minimum.at(begins, piece, along)
    np.maximum.at(ends, piece, along)
    side, number = np.divmod(band, len(ways))
    inside = (number[:, None] == way) & (begins[:, None] < depths)
    reach = np.where(inside, np.minimum(ends[:, None], depths), 0.0)
    return np.stack([reach[side == each].max(axis=0, initial=0.0) for each in (0, 1)])


def side_truncations(body: Polygon, slot: Slot, settings: Fabrication) -> tuple[float, float]:
    """Measures the same for one slot of a body."""
    depth = np.array([slot.depth])
    right, left = truncations(body, slot.mouth, slot.direction[None], depth, settings)[:, 0]
    return float(right), float(left)
