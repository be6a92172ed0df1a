"""Holds networks of polygonal units joined at their vertices by ligaments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim.core import Floats, Ints
from sim.structure.angles import angle_between

VOID_BRANCH, WIDE_VOID_BRANCH = -np.pi / 4, np.pi / 2
"""Void angles are unwrapped on [branch, branch + 2 pi): overlapping edges are slightly negative.
The second branch is that of voids between slender units, beyond 315 deg in the initial lattice."""


@dataclass(frozen=True)
class Lattice:
    """Holds a network of polygons in its reference state (specimen frame, mm).

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
        wide = self.resting_voids >= VOID_BRANCH + 2 * np.pi
        return np.where(wide, WIDE_VOID_BRANCH, VOID_BRANCH)

    @cached_property
    def resting_voids(self) -> Floats:
        """Gives the void angles (n_ligaments, 2) beside each ligament before any load, rad."""
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
        return voids

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
            group=groups(int(vertex.sum()), ligaments),
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


def network(polygons: list[Floats], ligaments: Ints, index: Ints, spacing: float) -> Lattice:
    """Builds a network of counter-clockwise polygons whose sites are their centroids."""
    vertices = np.concatenate(polygons)
    return Lattice(
        vertices=vertices,
        unit=np.repeat(np.arange(len(polygons)), [len(polygon) for polygon in polygons]),
        ligaments=ligaments,
        group=groups(len(vertices), ligaments),
        site=np.stack([moments(polygon)[1] for polygon in polygons]),
        index=index,
        spacing=spacing,
        id=np.arange(len(polygons)),
    )


def groups(n_vertices: int, ligaments: Ints) -> Ints:
    """Numbers the design groups by their first vertex: joined vertices together, others alone."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    joined = coo_array(
        (np.ones(len(ligaments)), (ligaments[:, 0], ligaments[:, 1])), shape=(n_vertices,) * 2
    )
    _, label = connected_components(joined, directed=False)
    _, first = np.unique(label, return_index=True)
    return np.argsort(np.argsort(first))[label]


def moments(ring: Floats) -> tuple[float, Floats]:
    """Computes the signed area and the centroid of a polygon."""
    here = ring - ring[0]
    there = np.roll(here, -1, axis=0)
    cross = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    area = cross.sum() / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(area), ring[0] + ((here + there) * cross[:, None]).sum(axis=0) / (6 * area)
