"""Checks manufacturability: that the units of a design can be cut, joined and moved.

Every requirement is one number per place (an edge, a corner, a side of a ligament, a pair of
units) that depends on a few vertices only.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from sim.constraints.slot_walls import (
    SlotGap,
    SlotWall,
    angle_ahead,
    angle_behind,
    points,
    slot_pairs,
    slot_turn,
    slot_walls,
    slots,
)
from sim.core import Floats, Ints, Numbers
from sim.structure import (
    ANGLE_LENGTH,
    VOID_BRANCH,
    Lattice,
    SlotRoom,
    angle_between,
    close_pairs,
    unwrap,
)


@dataclass(frozen=True)
class Limits:
    """Limits that a design must respect; ``None`` leaves a requirement out.

    Attributes:
        edge_length: smallest edge of any unit, mm.
        block_angle: smallest interior angle of a unit at any corner, rad.
        convex: no interior angle above pi.
        void_angle: smallest signed angle on either side of a ligament, rad.
        gap: smallest distance between neighbouring units, bonded or across a void, mm. Exact for
            convex units; for others that of their convex hulls, which is smaller.
        slots: room for slots along the ligaments, that leave the shims straight, or turned as the
            design turns them; for convex units.
        slot_turn: largest angle between a slot and its ligament, rad.
    """

    edge_length: float | None = None
    block_angle: float | None = None
    convex: bool = False
    void_angle: float | None = None
    gap: float | None = None
    slots: SlotRoom | None = None
    slot_turn: float | None = None


def edge_length(ends: Array) -> Array:
    """Measures the edge between two vertices (2, 2)."""
    return jnp.linalg.norm(ends[1] - ends[0])


def block_angle(corner: Array) -> Array:
    """Measures the interior angle at the second of three vertices (3, 2), on [-pi/4, 7 pi/4)."""
    return unwrap(angle_between(corner[2] - corner[1], corner[0] - corner[1]), VOID_BRANCH)


def void_angle(sides: Array) -> Array:
    """Measures the angle from one edge to another, two vertices each (4, 2), on [-pi/4, 7 pi/4)."""
    return unwrap(angle_between(sides[1] - sides[0], sides[3] - sides[2]), VOID_BRANCH)


def separation(pair: Array) -> Array:
    """Measures the signed distance of the convex hulls of two vertex rings (2, k, 2).

    The largest gap between the rings' projections over the normals of their edges and the lines
    between their vertices: the distance if they are apart, minus the depth of penetration if not.
    """
    one, other = pair
    normals = jnp.concatenate([_outward(one), -_outward(other)])
    axes = jnp.concatenate([normals, (other[None] - one[:, None]).reshape(-1, 2)])
    length = jnp.sqrt(jnp.maximum(jnp.sum(axes**2, axis=1), 1e-300))
    unit_axes = axes / length[:, None]
    gaps = jnp.min(unit_axes @ other.T, axis=1) - jnp.max(unit_axes @ one.T, axis=1)
    return jnp.max(jnp.where(length > 1e-9, gaps, -jnp.inf))


def _outward(ring: Array) -> Array:
    edge = jnp.roll(ring, -1, axis=0) - ring
    return jnp.stack([edge[:, 1], -edge[:, 0]], axis=1)


@dataclass(frozen=True)
class ConstraintKind:
    """Describes one kind of requirement: ``sign * (measure - limit) >= 0`` at every place."""

    name: str  # as in the reports
    unit: str  # of the measure and its margin
    measure: Callable[[Array], Array]  # function of the place's points
    places: Ints  # (n_places, ...) ids of those points, vertices and angles of slots
    limit: float  # bound of the measure
    sign: int = 1  # 1 if the bound is a smallest, -1 if it is a largest value

    @property
    def scale(self) -> float:
        """Returns the factor from the margin to the constraint value (mm)."""
        return ANGLE_LENGTH if self.unit == "rad" else 1.0

    def margins(self, measured: Numbers) -> Numbers:
        """Returns the margins (n_places,) of measured values, in the unit of the kind."""
        return self.sign * (measured - self.limit)

    def values_and_slopes(self, points: Array) -> tuple[Array, Array]:
        """Evaluates c (n_places,) and its slopes to the points, flattened."""
        values, slopes = jax.vmap(jax.value_and_grad(self.measure))(points[self.places])
        factor = self.sign * self.scale
        return factor * (values - self.limit), factor * slopes.ravel()


@dataclass(frozen=True)
class Margin:
    """Holds the smallest margin of one kind of requirement."""

    # edge_length, block_angle, convexity, void_angle, gap, slot_angle, slot_wall, slot_gap or
    # slot_turn
    kind: str
    value: float  # distance to the limit, negative if violated
    unit: str  # "mm" or "rad"
    units: tuple[int, ...]  # ids of the units at the worst place
    where: str  # the same as lattice indices, for messages


def kinds(
    lattice: Lattice, limits: Limits, moving: Ints | None = None
) -> tuple[ConstraintKind, ...]:
    """Lists the requirements of a lattice at the places that moving certain vertices can change.

    Units kept apart are those nearer than one lattice spacing; `moving` are ids of vertices, by
    default all.
    """
    free = np.ones(lattice.n_vertices + 2 * lattice.n_ligaments, dtype=bool)
    if moving is not None:
        free[:] = False
        free[moving] = True
    corners, edges = _corners(lattice, free), _edges(lattice, free)
    found: list[ConstraintKind] = []
    if limits.edge_length is not None:
        found.append(ConstraintKind("edge_length", "mm", edge_length, edges, limits.edge_length))
    if limits.block_angle is not None:
        found.append(ConstraintKind("block_angle", "rad", block_angle, corners, limits.block_angle))
    if limits.convex:
        found.append(ConstraintKind("convexity", "rad", block_angle, corners, np.pi, -1))
    if limits.void_angle is not None:
        voids = _voids(lattice, free)
        found.append(ConstraintKind("void_angle", "rad", void_angle, voids, limits.void_angle))
    if limits.gap is not None:
        found.append(ConstraintKind("gap", "mm", separation, _pairs(lattice, free), limits.gap))
    if (room := limits.slots) is not None:
        every, walls, pairs = (
            _touched(each(lattice), free) for each in (slots, slot_walls, slot_pairs)
        )
        found += [
            ConstraintKind("slot_angle", "rad", measure, every, room.angle)
            for measure in (angle_ahead, angle_behind)
        ]
        found.append(ConstraintKind("slot_wall", "mm", SlotWall(room), walls, room.wall))
        found.append(ConstraintKind("slot_gap", "mm", SlotGap(room), pairs, room.wall))
    if limits.slot_turn is not None:
        turned = _touched(slots(lattice)[:, 4:], free)
        found.append(ConstraintKind("slot_turn", "rad", slot_turn, turned, limits.slot_turn, -1))
    return tuple(found)


def _edges(lattice: Lattice, free: np.ndarray) -> Ints:
    return _touched(np.stack([np.arange(lattice.n_vertices), lattice.next_vertex], axis=1), free)


def _corners(lattice: Lattice, free: np.ndarray) -> Ints:
    here = np.arange(lattice.n_vertices)
    return _touched(np.stack([lattice.previous_vertex, here, lattice.next_vertex], axis=1), free)


def _voids(lattice: Lattice, free: np.ndarray) -> Ints:
    """Lists both sides of each ligament, as two edges starting at its ends (clockwise first).

    A void so wide that it is unwrapped otherwise is none: it is far from closed.
    """
    a, b = lattice.ligaments.T
    after, before = lattice.next_vertex, lattice.previous_vertex
    one = np.stack([b, before[b], a, after[a]], axis=1)
    other = np.stack([a, before[a], b, after[b]], axis=1)
    usual = lattice.void_branch.T.ravel() == VOID_BRANCH
    return _touched(np.concatenate([one, other])[usual], free)


def _pairs(lattice: Lattice, free: np.ndarray) -> Ints:
    """Pairs up the rings of neighbouring units, padded to equal length by repeating a vertex."""
    pairs = close_pairs(lattice, lattice.vertices, lattice.spacing)
    size = np.diff(lattice.first_vertex)
    step = np.minimum(np.arange(size.max())[None], size[:, None] - 1)
    rings = lattice.first_vertex[:-1, None] + step
    return _touched(rings[pairs], free)


def _touched(places: Ints, free: np.ndarray) -> Ints:
    return places[free[places].any(axis=tuple(range(1, places.ndim)))]


def margins(
    lattice: Lattice, vertices: Floats, limits: Limits, end_angles: Floats | None = None
) -> dict[str, Margin]:
    """Finds the smallest margin of each kind over the whole structure, free or not.

    `vertices` (n_vertices, 2) are in mm; `end_angles` (n_ligaments, 2) are those of slots against
    their ligaments, rad, by default zero.
    """
    return worst(lattice, kinds(lattice, limits), points(lattice, vertices, end_angles))


def worst(
    lattice: Lattice, requirements: tuple[ConstraintKind, ...], at: Floats
) -> dict[str, Margin]:
    """Finds the smallest margin of each kind among some requirements, and the units concerned.

    `at` (n_points, 2) are places of `points`, mm.
    """
    found: dict[str, Margin] = {}
    present = [kind for kind in requirements if len(kind.places)]
    measures, places = tuple(k.measure for k in present), tuple(k.places for k in present)
    for kind, measured in zip(present, _measured(measures, places, at), strict=True):
        values = kind.margins(np.asarray(measured))
        place = int(np.argmin(values))
        if kind.name in found and found[kind.name].value <= values[place]:
            continue
        concerned = np.unique(lattice.unit[_vertices(lattice, kind.places[place])])
        units = tuple(int(unit) for unit in concerned)
        where = " and ".join(f"unit ({i}, {j})" for i, j in lattice.index[list(units)])
        found[kind.name] = Margin(kind.name, float(values[place]), kind.unit, units, where)
    return found


@partial(jax.jit, static_argnums=0)
def _measured(
    measures: tuple[Callable[[Array], Array], ...], places: tuple[Ints, ...], points: Floats
) -> list[Array]:
    corners = jnp.asarray(points)
    return [jax.vmap(of)(corners[at]) for of, at in zip(measures, places, strict=True)]


def _vertices(lattice: Lattice, place: Ints) -> Ints:
    """Lists the vertices of a place; that of an angle is the vertex of its slot."""
    every = np.concatenate([np.arange(lattice.n_vertices), lattice.ligaments.ravel()])
    return np.unique(every[place])


def vertices_of(lattice: Lattice, place: Ints) -> str:
    """Names the vertices of a place by their numbers within their units."""
    words, vertices = [], _vertices(lattice, place)
    for unit in np.unique(lattice.unit[vertices]):
        own = vertices[lattice.unit[vertices] == unit] - lattice.first_vertex[unit]
        i, j = lattice.index[unit]
        words.append(f"vertex {', '.join(map(str, own))} of unit [{i}, {j}]")
    return " and ".join(words)
