"""Keeps room in units for slots along their ligaments, so that shims are straight as built.

A slot goes on along its ligament into a unit, as shallow as the edges at its vertex allow. Around
its inner end there have to be walls, and between two slots of a unit as well. Then each shim is
straight before any load: what is built is free of stress, as simulated.

Three requirements say so: the angle between slot and edge at the vertex, for the deepest slot to
have its walls there; the wall to all other edges; and that to other slots.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.core import Ints, Numbers
from sim.structure import Lattice, SlotRoom, angle_between


def slot_depth(room: SlotRoom, along: Numbers, behind: Numbers, ahead: Numbers) -> Array:
    """Computes the depth of a slot between two edges of a unit, mm.

    It is the least at which both edges are a wall away from the inner end, and what is left of the
    slot where the tip is cut back holds the shim.

    Args:
        room: that slots need.
        along: (2,) vector of the slot, into the unit.
        behind: (2,) vector of the edge before the vertex, from the vertex.
        ahead: (2,) vector of the edge after it.
    """
    angles = jnp.stack([angle_between(ahead, along), angle_between(along, behind)])
    sine = jnp.maximum(jnp.sin(angles), np.sin(room.angle))
    outside = (room.width / 2.0 + room.tip) * jnp.cos(angles)
    needed = jnp.maximum(room.cover, room.grip * sine + outside)
    return jnp.minimum(jnp.max(needed / sine), room.depth)


@dataclass(frozen=True)
class SlotWall:
    """Measures the wall between the inner end of a slot, taken as round, and an edge's line.

    A place is a slot, as of `slots`, and an edge that does not end there (6, 2), of a convex unit.
    """

    room: SlotRoom

    def __call__(self, place: Array) -> Array:
        """Measures the wall, mm; negative outside of the unit."""
        start, edge = place[4], place[5] - place[4]
        inward = jnp.stack([-edge[1], edge[0]]) / jnp.linalg.norm(edge)
        return inward @ (_inner_end(self.room, place[:4]) - start) - self.room.width / 2.0


@dataclass(frozen=True)
class SlotGap:
    """Measures the wall between two slots of a unit that do not cross.

    A place is two slots, as of `slots` (8, 2).
    """

    room: SlotRoom

    def __call__(self, place: Array) -> Array:
        """Measures the wall, mm."""
        mouth, other_mouth = place[1], place[5]
        end, other = _inner_end(self.room, place[:4]), _inner_end(self.room, place[4:])
        ways = [
            *(_distance(point, mouth, end) for point in (other_mouth, other)),
            *(_distance(point, other_mouth, other) for point in (mouth, end)),
        ]
        return jnp.min(jnp.stack(ways)) - self.room.width


def slots(lattice: Lattice) -> Ints:
    """Lists the slots at both ends of all ligaments.

    Returns:
        (n_slots, 4) far end of the ligament, vertex of the slot, the ones before and after it.
    """
    far, mouth = lattice.ligaments[:, ::-1].T.ravel(), lattice.ligaments.T.ravel()
    beside = (lattice.previous_vertex[mouth], lattice.next_vertex[mouth])
    return np.stack([far, mouth, *beside], axis=1)


def slot_angles(lattice: Lattice) -> Ints:
    """Lists the angles between slots and edges at their vertices, (n, 4) vertices of both sides."""
    far, mouth, before, after = slots(lattice).T
    sides = (mouth, after, far, mouth), (far, mouth, mouth, before)
    return np.concatenate([np.stack(each, axis=1) for each in sides])


def slot_walls(lattice: Lattice) -> Ints:
    """Lists each slot with each farther edge of its unit, (n, 6) vertices: places of `SlotWall`."""
    every = slots(lattice)
    _, mouth, before, _ = every.T[..., None]
    edges = np.arange(lattice.n_vertices)
    farther = (lattice.unit[mouth] == lattice.unit) & (edges != mouth) & (edges != before)
    slot, edge = np.nonzero(farther)
    return np.column_stack([every[slot], edge, lattice.next_vertex[edge]])


def slot_pairs(lattice: Lattice) -> Ints:
    """Lists the pairs of slots of a unit, (n, 8) vertices: places of `SlotGap`."""
    every = slots(lattice)
    unit = lattice.unit[every[:, 1]]
    first, second = np.nonzero(np.triu(unit[:, None] == unit, 1))
    return np.column_stack([every[first], every[second]])


def _inner_end(room: SlotRoom, slot: Array) -> Array:
    far, mouth, before, after = slot
    along = (mouth - far) / jnp.linalg.norm(mouth - far)
    return mouth + slot_depth(room, along, before - mouth, after - mouth) * along


def _distance(point: Array, start: Array, stop: Array) -> Array:
    """Measures the distance of a point to a segment."""
    along = stop - start
    share = jnp.clip((point - start) @ along / (along @ along), 0.0, 1.0)
    return jnp.linalg.norm(point - start - share * along)
