"""Builds networks of polygonal units joined at their vertices by ligaments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sim.core import Floats, Ints
from sim.structure.angles import angle_between

VOID_BRANCH, WIDE_VOID_BRANCH = -np.pi / 4, np.pi / 2
"""Void angles are unwrapped on [branch, branch + 2 pi): overlapping edges are slightly negative.
The second branch is that of voids between slender units, beyond 315 deg in the initial lattice."""


@dataclass(frozen=True)
class Lattice:
    """A polygon network in its reference state (specimen frame, mm).

    The vertices of all units lie in one flat array, each polygon contiguous and counter-clockwise,
    so that units of any number of vertices mix freely.

    Attributes:
        vertices: (n_vertices, 2) positions.
        unit: (n_vertices,) owner of each vertex.
        ligaments: (n_ligaments, 2) vertex ids; a ligament runs from the first to the second.
        group: (n_vertices,) design group; the vertices of a group are shifted together, so the two
            ends of a ligament share one and the ligament keeps its vector.
        site: (n_units, 2) lattice points.
        index: (n_units, 2) lattice indices (i, j).
        spacing: distance of neighbouring lattice points.
        id: (n_units,) the units' ids, ascending; where units were removed, those of the whole.
    """

    vertices: Floats
    unit: Ints
    ligaments: Ints
    group: Ints
    site: Floats
    index: Ints
    spacing: float
    id: Ints

    @property
    def n_units(self) -> int:
        """Counts the units."""
        return len(self.site)

    @property
    def n_vertices(self) -> int:
        """Counts the vertices of all units."""
        return len(self.vertices)

    @property
    def n_ligaments(self) -> int:
        """Counts the ligaments."""
        return len(self.ligaments)

    @cached_property
    def n_groups(self) -> int:
        """Counts the design groups."""
        return int(self.group.max()) + 1

    @cached_property
    def first_vertex(self) -> Ints:
        """Gives the start of each polygon in the vertex array, the end appended (n_units + 1,)."""
        counts = np.bincount(self.unit, minlength=self.n_units)
        return np.concatenate([[0], np.cumsum(counts)])

    @cached_property
    def next_vertex(self) -> Ints:
        """Gives the counter-clockwise neighbour (n_vertices,) of each vertex in its polygon."""
        start, end = self.first_vertex[self.unit], self.first_vertex[self.unit + 1]
        following = np.arange(self.n_vertices) + 1
        return np.where(following == end, start, following)

    @cached_property
    def previous_vertex(self) -> Ints:
        """Gives the clockwise neighbour (n_vertices,) of each vertex in its polygon."""
        previous = np.empty_like(self.next_vertex)
        previous[self.next_vertex] = np.arange(self.n_vertices)
        return previous

    @cached_property
    def ligament_units(self) -> Ints:
        """Gives the units (n_ligaments, 2) joined by each ligament."""
        return self.unit[self.ligaments]

    @cached_property
    def ligament_vectors(self) -> Floats:
        """Gives the reference vector (n_ligaments, 2) of each ligament."""
        ends = self.vertices[self.ligaments]
        return ends[:, 1] - ends[:, 0]

    @cached_property
    def void_branch(self) -> Floats:
        """Gives the least void angle (n_ligaments, 2) on each side of a ligament, rad.

        That is negative, as units may overlap, but where the void is a wide one.
        """
        ahead = self.vertices[self.next_vertex] - self.vertices
        behind = self.vertices[self.previous_vertex] - self.vertices
        first, second = self.ligaments.T
        angles = np.stack(
            [
                angle_between(behind[second], ahead[first]),
                angle_between(behind[first], ahead[second]),
            ],
            axis=1,
        )
        voids = np.where(angles < VOID_BRANCH, angles + 2 * np.pi, angles)
        corners = angle_between(ahead, behind)[self.ligaments] % (2 * np.pi)
        # the voids and the corners go once round a ligament, or the smaller void is a turn short
        short = np.rint((voids + corners).sum(axis=1) / (2 * np.pi)) < 1
        voids[short, voids[short].argmin(axis=1)] += 2 * np.pi
        return np.where(voids >= VOID_BRANCH + 2 * np.pi, WIDE_VOID_BRANCH, VOID_BRANCH)

    def positions(self, ids: Ints) -> Ints:
        """Finds the positions of units with the given ids in the arrays over units.

        Raises:
            KeyError: the network has no such unit.
        """
        found = np.searchsorted(self.id, ids)
        known = np.append(self.id, -1)[found] == ids
        if not np.all(known):
            raise KeyError(f"no unit {np.asarray(ids)[~known][0]}")
        return found

    def without(self, ids: Ints) -> Lattice:
        """Removes some units and the ligaments that end at them.

        A vertex whose ligament is gone is a design group by itself.
        """
        kept = ~np.isin(self.id, ids)
        vertex = kept[self.unit]
        new_unit, new_vertex = np.cumsum(kept) - 1, np.cumsum(vertex) - 1
        ligaments = new_vertex[self.ligaments[vertex[self.ligaments].all(axis=1)]]
        return Lattice(
            vertices=self.vertices[vertex],
            unit=new_unit[self.unit[vertex]],
            ligaments=ligaments,
            group=_groups(int(vertex.sum()), ligaments),
            site=self.site[kept],
            index=self.index[kept],
            spacing=self.spacing,
            id=self.id[kept],
        )

    def padded(self, values: Floats) -> Floats:
        """Rearranges a per-vertex array (n_vertices, k) by units (n_units, most, k), NaN padded."""
        counts = np.diff(self.first_vertex)
        out = np.full((self.n_units, int(counts.max()), values.shape[1]), np.nan)
        out[self.unit, np.arange(self.n_vertices) - self.first_vertex[self.unit]] = values
        return out


def quads(
    columns: int, rows: int, spacing: float, ligament_length: float, bias_angle: float
) -> Lattice:
    """Builds rotating squares: units on a square grid, joined at their four corners.

    Unit ``i + columns * j`` has its lattice point at ``(i, j) * spacing`` and its vertices in the
    order right, top, left, bottom. Units with even ``i + j`` are turned by ``-bias_angle`` (rad),
    the others by ``+bias_angle``, and scaled so that the ligaments stay horizontal and vertical.
    """
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(columns), np.arange(rows)))
    site = np.stack([i, j], axis=1) * np.float64(spacing)
    turn = np.where((i + j) % 2 == 0, -1.0, 1.0) * np.tan(bias_angle)
    half = (spacing - ligament_length) / 2
    right = half * np.stack([np.ones_like(turn), turn], axis=1)
    top = np.stack([-right[:, 1], right[:, 0]], axis=1)
    vertices: Floats = (site[:, None, :] + np.stack([right, top, -right, -top], axis=1)).reshape(
        -1, 2
    )

    unit_id = np.arange(columns * rows).reshape(rows, columns)
    horizontal = np.stack([4 * unit_id[:, :-1].ravel(), 4 * unit_id[:, 1:].ravel() + 2], axis=1)
    vertical = np.stack([4 * unit_id[:-1].ravel() + 1, 4 * unit_id[1:].ravel() + 3], axis=1)
    ligaments = np.concatenate([horizontal, vertical])
    return Lattice(
        vertices=vertices,
        unit=np.repeat(np.arange(columns * rows), 4),
        ligaments=ligaments,
        group=_groups(len(vertices), ligaments),
        site=site,
        index=np.stack([i, j], axis=1),
        spacing=spacing,
        id=np.arange(columns * rows),
    )


def kagome(
    columns: int,
    rows: int,
    spacing: float,
    ligament_length: float,
    bias: float,
    cell_angle: float = np.pi / 3,
) -> Lattice:
    """Builds kagome triangles: two in each cell, joined there and to the neighbouring cells.

    A cell is spanned by ``spacing`` along x and along the direction ``cell_angle`` (rad). Its
    joints are the middles of its four sides and its centre; ligaments run through them along the
    three directions of the regular lattice. Joints of cells with even i and j are moved up by
    ``bias`` (mm), those with odd i and j down. Unit ``2 i + k + 2 columns j`` is triangle k of cell
    (i, j), the lower left one first (the authors' geometry).
    """
    across = spacing * np.array([1.0, 0.0])
    along = spacing * np.array([np.cos(cell_angle), np.sin(cell_angle)])
    inner, right, up = (
        ligament_length / 2 * np.array([[np.sqrt(0.75), 0.5], [np.sqrt(0.75), -0.5], [0.0, 1.0]])
    )
    polygons, ligaments = [], []
    unit_of = np.arange(2 * columns * rows).reshape(rows, columns, 2)
    for j, i in np.ndindex(rows, columns):
        left, below, centre, beyond, above = (
            (i + a) * across + (j + b) * along + [0.0, bias * _parity(p, q)]
            for a, b, p, q in (
                (0.0, 0.5, i, j),
                (0.5, 0.0, i, j),
                (0.5, 0.5, i, j),
                (1.0, 0.5, i + 1, j),
                (0.5, 1.0, i, j + 1),
            )
        )
        polygons += [
            np.stack([left + right, below + up, centre - inner]),
            np.stack([centre + inner, beyond - right, above - up]),
        ]
        here, other = 3 * unit_of[j, i]
        ligaments.append((here + 2, other))
        if i + 1 < columns:
            ligaments.append((other + 1, 3 * unit_of[j, i + 1, 0]))
        if j + 1 < rows:
            ligaments.append((other + 2, 3 * unit_of[j + 1, i, 0] + 1))
    j, i = np.divmod(np.arange(2 * columns * rows), 2 * columns)
    return _network(polygons, np.array(ligaments), np.stack([i, j], axis=1), spacing)


def honeycomb(
    columns: int, rows: int, spacing: float, ligament_length: float, bias_angle: float = 0.0
) -> Lattice:
    """Builds rotating triangles: units on a honeycomb, joined at their three corners.

    Neighbours are ``spacing`` apart. Rows are zigzags of units along x, and unit
    ``i + columns * j`` with even ``i + j`` has its third neighbour in the row above, with odd in
    the row below. The first are turned by ``-bias_angle`` (rad), the others by ``+bias_angle``,
    and scaled so that the ligaments stay along the lines of the honeycomb.
    """
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(columns), np.arange(rows)))
    even = (i + j) % 2 == 0
    site = spacing * np.stack([np.sqrt(0.75) * i, 1.5 * j + 0.5 * even], axis=1)
    first, turn = np.where(even, np.pi / 2, -np.pi / 2), np.where(even, -bias_angle, bias_angle)
    return _regular(3, site, np.stack([i, j], axis=1), spacing, ligament_length, first, turn)


def triangular(columns: int, rows: int, spacing: float, ligament_length: float) -> Lattice:
    """Builds hexagons on a triangular lattice, joined at their six corners.

    Neighbours are ``spacing`` apart. Rows are along x, and every other one, from the second on, is
    shifted by half a spacing. Unit ``i + columns * j`` is the i-th of row j.
    """
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(columns), np.arange(rows)))
    site = spacing * np.stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j], axis=1)
    straight = np.zeros(len(i))
    index = np.stack([i, j], axis=1)
    return _regular(6, site, index, spacing, ligament_length, straight, straight)


def _regular(
    corners: int,
    site: Floats,
    index: Ints,
    spacing: float,
    ligament_length: float,
    first: Floats,
    turn: Floats,
) -> Lattice:
    """Builds regular polygons on sites, a corner towards each neighbour ``spacing`` away.

    The directions of a unit's neighbours are ``first`` (n_units,) and on by equal angles; ``turn``
    (n_units,) is that of the polygons, opposite in neighbours (rad).
    """
    from scipy.spatial import cKDTree

    towards = first[:, None] + 2 * np.pi / corners * np.arange(corners)
    reach = (spacing - ligament_length) / 2 / np.cos(turn)
    angle = towards + turn[:, None]
    out = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    polygons = list(site[:, None] + reach[:, None, None] * out)
    pairs = cKDTree(site).query_pairs(1.01 * spacing, output_type="ndarray")
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    x, y = (site[pairs[:, 1]] - site[pairs[:, 0]]).T
    along = np.stack([np.arctan2(y, x), np.arctan2(-y, -x)], axis=1)
    corner = np.cos(towards[pairs] - along[:, :, None]).argmax(axis=2)
    return replace(_network(polygons, corners * pairs + corner, index, spacing), site=site)


def _parity(i: int, j: int) -> float:
    """Returns 1 where both numbers are even, -1 where both are odd, else 0."""
    return {(0, 0): 1.0, (1, 1): -1.0}.get((i % 2, j % 2), 0.0)


REACH = 0.05
"""A ligament given by its end points ends at the vertex within this share of the spacing."""


def listed(
    polygons: Sequence[Sequence[tuple[float, float]]],
    ligaments: Sequence[tuple[tuple[float, float], tuple[float, float]]],
    spacing: float,
) -> Lattice:
    """Builds units from lists of corners (mm), either way round, and ligaments from end points.

    Raises:
        ValueError: a polygon without area or on another, or a ligament that is listed twice or does
            not end at two units' vertices.
    """
    from scipy.spatial import cKDTree

    rings = [_counter_clockwise(np.array(polygon, dtype=float)) for polygon in polygons]
    _refuse_covered(rings)
    vertices = np.concatenate(rings)
    unit = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    known: dict[frozenset[int], int] = {}
    ends = np.array(ligaments, dtype=float).reshape(-1, 2, 2)
    distance, place = cKDTree(vertices).query(ends)
    for number, (far, (one, other)) in enumerate(zip(distance, place, strict=True)):
        where = "ligament {} from ({:g}, {:g}) to ({:g}, {:g}) mm".format(
            number, *np.round(ends[number].ravel(), 3)
        )
        if far.max() > REACH * spacing:
            raise ValueError(f"{where} ends {far.max():.3g} mm away from any unit's corner")
        if unit[one] == unit[other]:
            raise ValueError(f"{where} begins and ends at the same unit")
        first = known.setdefault(frozenset((int(one), int(other))), number)
        if first != number:
            raise ValueError(f"{where} is listed before, as number {first}")
    index = np.stack([np.arange(len(rings)), np.zeros(len(rings), dtype=np.int64)], axis=1)
    return _network(rings, place, index, spacing)


def _refuse_covered(rings: list[Floats]) -> None:
    """Refuses two polygons of which one covers more than half of the other."""
    import shapely

    shapes = shapely.make_valid(np.array([shapely.Polygon(ring) for ring in rings]))
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    first, second = first[first < second], second[first < second]
    shared = shapely.area(shapely.intersection(shapes[first], shapes[second]))
    smaller = np.minimum(shapely.area(shapes[first]), shapely.area(shapes[second]))
    for covering in np.flatnonzero(shared > smaller / 2):
        one, other = first[covering], second[covering]
        x, y = np.round(_moments(rings[one])[1], 3) + 0.0
        raise ValueError(f"polygons {one} and {other} lie in one place, about ({x:g}, {y:g}) mm")


def _counter_clockwise(ring: Floats) -> Floats:
    area = _moments(ring)[0] if len(ring) > 0 else 0.0
    if abs(area) < 1e-9 or not np.isfinite(area):
        raise ValueError(f"a polygon of {len(ring)} corners has no area")
    return ring if area > 0 else ring[::-1]


def _moments(ring: Floats) -> tuple[float, Floats]:
    """Computes the signed area and the centroid of a polygon."""
    here = ring - ring[0]
    there = np.roll(here, -1, axis=0)
    cross = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    area = cross.sum() / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(area), ring[0] + ((here + there) * cross[:, None]).sum(axis=0) / (6 * area)


def _network(polygons: list[Floats], ligaments: Ints, index: Ints, spacing: float) -> Lattice:
    """Builds a network of counter-clockwise polygons whose sites are their centroids."""
    vertices = np.concatenate(polygons)
    return Lattice(
        vertices=vertices,
        unit=np.repeat(np.arange(len(polygons)), [len(polygon) for polygon in polygons]),
        ligaments=ligaments,
        group=_groups(len(vertices), ligaments),
        site=np.stack([_moments(polygon)[1] for polygon in polygons]),
        index=index,
        spacing=spacing,
        id=np.arange(len(polygons)),
    )


def _groups(n_vertices: int, ligaments: Ints) -> Ints:
    """Numbers the design groups by their first vertex: joined vertices together, others alone."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    joined = coo_array(
        (np.ones(len(ligaments)), (ligaments[:, 0], ligaments[:, 1])), shape=(n_vertices,) * 2
    )
    _, label = connected_components(joined, directed=False)
    _, first = np.unique(label, return_index=True)
    return np.argsort(np.argsort(first))[label]
