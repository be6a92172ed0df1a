"""Finds the pairs of units that may meet, where contact acts on their distance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sim.collision.neighbour_list import MAX_NEW_PAIRS, TERMS_PER_VERTEX
from sim.collision.polygons import ContactArrays, NeighbourCache
from sim.core import Ints, NewContactPairs
from sim.structure import ConcreteParameters, Lattice, VoidAngleContact, close_pairs

MARGIN = 1 / 15
"""Motion of a unit after which neighbours are searched for again, in lattice spacings."""


@dataclass(frozen=True)
class CandidatePairs:
    """Holds units as polygons, and the pairs of them that the tangent couples."""

    pairs: Ints  # (n_pairs, 2) units, ascending
    first: Ints  # (n_units + 1,) start of each polygon in the vertices
    following: Ints  # (n_vertices,) the counter-clockwise neighbour of each vertex
    distance: float  # activation distance, mm
    length: float  # mean length of the ligaments, mm
    reach: float  # distance within which units are watched, mm

    @property
    def owner(self) -> Ints:
        """(n_vertices,) unit of each vertex."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    def with_pairs(self, new_pairs: Ints) -> CandidatePairs:
        """Adds pairs (n, 2) of units."""
        return replace(self, pairs=np.unique(np.concatenate([self.pairs, new_pairs]), axis=0))


def find_candidate_pairs(lattice: Lattice, distance: float) -> CandidatePairs:
    """Pairs the units of a lattice within one spacing at rest, which are expected to meet.

    Others may meet as well: a solve finds out, and is repeated with them (``with_pairs``).
    """
    return CandidatePairs(
        pairs=close_pairs(lattice, lattice.vertices, lattice.spacing),
        first=np.ascontiguousarray(lattice.first_vertex),
        following=np.ascontiguousarray(lattice.next_vertex),
        distance=distance,
        length=float(np.linalg.norm(lattice.ligament_vectors, axis=1).mean()),
        reach=lattice.spacing,
    )


def contact_arrays(
    candidate_pairs: CandidatePairs | VoidAngleContact, values: ConcreteParameters, n_units: int
) -> ContactArrays:
    """Lays out the kernels' arrays of concrete parameters; no pairs where void angles count."""
    corner = np.array(values.corner, dtype=float, order="C")
    if isinstance(candidate_pairs, VoidAngleContact):
        none = np.zeros(0, dtype=np.int64)
        candidate_pairs = CandidatePairs(none.reshape(0, 2), none, none, 1.0, 1.0, 1.0)
    n_vertices = len(candidate_pairs.following)
    radius = np.zeros(len(candidate_pairs.first[1:]))
    np.maximum.at(radius, candidate_pairs.owner, np.linalg.norm(corner[:n_vertices], axis=1))
    scale = (candidate_pairs.distance / candidate_pairs.length) ** 2
    return ContactArrays(
        pairs=np.ascontiguousarray(candidate_pairs.pairs),
        first=candidate_pairs.first,
        owner=candidate_pairs.owner,
        following=candidate_pairs.following,
        corner=corner,
        centroid=np.array(values.centroid, dtype=float, order="C"),
        radius=radius,
        energy=float(values.contact.mean()) * scale,
        per_stiffness=scale / len(values.contact),
        distance=candidate_pairs.distance,
        reach=candidate_pairs.reach,
        margin=MARGIN * candidate_pairs.reach,
        cache=_empty_cache(candidate_pairs, n_units),
    )


def new_pairs(contacts: ContactArrays) -> Ints:
    """Lists the pairs (n, 2) of units for which a solve ended: the tangent has no room for them."""
    return contacts.cache.new_pairs[: contacts.cache.found[1]].copy()


def raise_new_pairs(contacts: ContactArrays) -> None:
    """Raises ``NewContactPairs`` if a solve ended since the tangent has no room for a pair."""
    if len(pairs := new_pairs(contacts)) > 0:
        raise NewContactPairs(pairs)


def _empty_cache(candidate_pairs: CandidatePairs, n_units: int) -> NeighbourCache:
    """Allocates scratch that belongs to no state yet."""
    n_vertices, n_watched = len(candidate_pairs.following), len(candidate_pairs.first[1:])
    return NeighbourCache(
        state=np.full(3 * n_units, np.inf),
        place=np.zeros((n_vertices, 2)),
        centre=np.zeros((n_watched, 2)),
        searched=np.full(3 * n_units, np.inf),
        moved=np.zeros(n_watched),
        gap=np.zeros(len(candidate_pairs.pairs)),
        room=np.zeros(1),
        new_pairs=np.zeros((MAX_NEW_PAIRS, 2), dtype=np.int64),
        terms=np.zeros((TERMS_PER_VERTEX * n_vertices, 3), dtype=np.int64),
        found=np.zeros(2, dtype=np.int64),
        overlap=np.full(2, -1),
    )
