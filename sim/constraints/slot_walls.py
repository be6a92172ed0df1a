"""Measures the walls in units beside and between the slots that hold ligaments.

A slot goes on along its ligament into a unit, or is turned against it where the design turns slots,
as shallow as the edges at its vertex allow. Around its inner end there have to be walls, and
between two slots of a unit as well. Slots along the ligaments leave each shim straight before any
load: what is built is free of stress.

Three requirements say so: the angle between slot and edge at the vertex, for the deepest slot to
have its walls there; the wall to all other edges; and that to other slots. A fourth bounds the
angle between slot and ligament, for the law of ligaments to hold.

The angles of slots come as further points after the vertices, one for each end of a ligament, whose
first coordinate is the angle times `ANGLE_LENGTH`; so one place takes vertices and angles.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Floats, Ints, Numbers
from sim.structure import ANGLE_LENGTH, VOID_BRANCH, Lattice, SlotRoom, angle_between, unwrap


def slot_depth(room: SlotRoom, along: Numbers, behind: Numbers, ahead: Numbers) -> Array:
    """Computes the depth of a slot between two edges of a unit, mm.

    It is the least at which both edges are a wall away from the inner end, and what is left of the
    slot where the tip is cut back holds the shim. `along` (2,) is the vector of the slot, into the
    unit; `behind` and `ahead` (2,) are those of the edges before and after the vertex, from it.
    """
    angles = jnp.stack([angle_between(ahead, along), angle_between(along, behind)])
    sine = jnp.maximum(jnp.sin(angles), np.sin(room.angle))
    outside = (room.width / 2.0 + room.tip) * jnp.cos(angles)
    needed = jnp.maximum(room.cover, room.grip * sine + outside)
    return jnp.minimum(jnp.max(needed / sine), room.depth)


@dataclass(frozen=True)
class SlotWall:
    """Measures the wall between the inner end of a slot, taken as round, and an edge's line.

    A place is a slot, as of `slots`, and an edge that does not end there (7, 2), of a convex unit.
    """

    room: SlotRoom

    def __call__(self, place: Array) -> Array:
        """Measures the wall, mm; negative outside of the unit."""
        start, edge = place[5], place[6] - place[5]
        inward = jnp.stack([-edge[1], edge[0]]) / jnp.linalg.norm(edge)
        return inward @ (_inner_end(self.room, place[:5]) - start) - self.room.width / 2.0


@dataclass(frozen=True)
class SlotGap:
    """Measures the wall between two slots of a unit that do not cross.

    A place is two slots, as of `slots` (10, 2).
    """

    room: SlotRoom

    def __call__(self, place: Array) -> Array:
        """Measures the wall, mm."""
        mouth, other_mouth = place[1], place[6]
        end, other = _inner_end(self.room, place[:5]), _inner_end(self.room, place[5:])
        ways = [
            *(_distance(point, mouth, end) for point in (other_mouth, other)),
            *(_distance(point, other_mouth, other) for point in (mouth, end)),
        ]
        return jnp.min(jnp.stack(ways)) - self.room.width


def points(lattice: Lattice, vertices: Numbers, end_angles: Floats | None = None) -> Floats:
    """Lists vertices and slots' angles (n_vertices + 2 n_ligaments, 2) as places take them, mm.

    `vertices` (n_vertices, 2) are in mm; `end_angles` (n_ligaments, 2) are those of slots against
    their ligaments, rad, by default zero.
    """
    turns = np.zeros((2 * lattice.n_ligaments, 2))
    if end_angles is not None:
        turns[:, 0] = ANGLE_LENGTH * end_angles.ravel()
    return np.concatenate([np.asarray(vertices), turns])


def slots(lattice: Lattice) -> Ints:
    """Lists the slots at both ends of all ligaments.

    Returns:
        (n_slots, 5) far end of the ligament, vertex of the slot, the ones before and after it, and
        the point of the slot's angle.
    """
    far, mouth = lattice.ligaments[:, ::-1].ravel(), lattice.ligaments.ravel()
    beside = (lattice.previous_vertex[mouth], lattice.next_vertex[mouth])
    angle = lattice.n_vertices + np.arange(len(mouth))
    return np.stack([far, mouth, *beside, angle], axis=1)


def angle_ahead(slot: Array) -> Array:
    """Measures the angle (rad) from the edge after a slot (5, 2) to the slot."""
    return unwrap(angle_between(slot[3] - slot[1], _along(slot)), VOID_BRANCH)


def angle_behind(slot: Array) -> Array:
    """Measures the angle (rad) from a slot (5, 2) to the edge before it."""
    return unwrap(angle_between(_along(slot), slot[2] - slot[1]), VOID_BRANCH)


def slot_turn(angle: Array) -> Array:
    """Measures the angle (rad) between a slot and its ligament, of its point (1, 2)."""
    return jnp.abs(angle[0, 0]) / ANGLE_LENGTH


def slot_walls(lattice: Lattice) -> Ints:
    """Lists each slot with each farther edge of its unit, (n, 7) points: places of `SlotWall`."""
    every = slots(lattice)
    unit = lattice.unit[every[:, 1]]
    slot, place = _counted(np.diff(lattice.first_vertex)[unit])
    edge = lattice.first_vertex[unit[slot]] + place
    farther = (edge != every[slot, 1]) & (edge != every[slot, 2])
    slot, edge = slot[farther], edge[farther]
    return np.column_stack([every[slot], edge, lattice.next_vertex[edge]])


def slot_pairs(lattice: Lattice) -> Ints:
    """Lists the pairs of slots of a unit, (n, 10) points: places of `SlotGap`."""
    every = slots(lattice)
    unit = lattice.unit[every[:, 1]]
    order = np.argsort(unit, kind="stable")
    end = np.searchsorted(unit[order], unit[order], side="right")
    at, place = _counted(end - np.arange(len(unit)) - 1)
    first, second = order[at], order[at + 1 + place]
    ascending = np.lexsort((second, first))
    return np.column_stack([every[first[ascending]], every[second[ascending]]])


def _counted(counts: Ints) -> tuple[Ints, Ints]:
    """Repeats each place as often as it counts; also numbers the repetitions, from zero."""
    every = np.repeat(np.arange(len(counts)), counts)
    return every, np.arange(len(every)) - np.repeat(np.cumsum(counts) - counts, counts)


def _along(slot: Array) -> Array:
    """Finds the unit vector (2,) of a slot (5, 2) into its unit."""
    far, mouth, _, _, angle = slot
    x, y = (mouth - far) / jnp.linalg.norm(mouth - far)
    cosine, sine = jnp.cos(angle[0] / ANGLE_LENGTH), jnp.sin(angle[0] / ANGLE_LENGTH)
    return jnp.stack([cosine * x - sine * y, sine * x + cosine * y])


def _inner_end(room: SlotRoom, slot: Array) -> Array:
    _, mouth, before, after, _ = slot
    along = _along(slot)
    return mouth + slot_depth(room, along, before - mouth, after - mouth) * along


def _distance(point: Array, start: Array, stop: Array) -> Array:
    """Measures the distance of a point to a segment."""
    along = stop - start
    share = jnp.clip((point - start) @ along / (along @ along), 0.0, 1.0)
    return jnp.linalg.norm(point - start - share * along)
