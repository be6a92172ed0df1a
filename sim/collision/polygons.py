"""Outlines of units in a state: where they are, how near two come, and whether they cross."""

import math
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints, compiled


class NeighbourCache(NamedTuple):
    """Caches the last state looked at; overwritten at will."""

    state: Floats  # (n_dofs,) that state
    place: Floats  # (n_vertices, 2) its vertices, mm
    centre: Floats  # (n_units, 2) its centroids, mm
    searched: Floats  # (n_dofs,) the state of the last sweep
    moved: Floats  # (n_units,) bound of the motion of each unit's points since then, mm
    gap: Floats  # (n_pairs,) distance of the pairs then, or a lower bound of it, mm
    room: Floats  # (1,) smallest distance of a new pair then, or a lower bound of it, mm
    new_pairs: Ints  # (MAX_NEW_PAIRS, 2) units of pairs that the tangent has no room for
    terms: Ints  # (n, 3) vertex, and the start and end of an edge; the end is -1 for a vertex alone
    found: Ints  # (2,) number of terms, -1 if the state is not admissible, and number of new pairs
    overlap: Ints  # (2,) units that overlap, if the state is not admissible


class ContactArrays(NamedTuple):
    """Units that may meet, as the kernels take them; without pairs there is no contact."""

    pairs: Ints  # (n_pairs, 2) units, ascending, whose coupling the tangent has room for
    first: Ints  # (n_units + 1,) start of each polygon in the vertices
    owner: Ints  # (n_vertices,) unit of each vertex
    following: Ints  # (n_vertices,) its counter-clockwise neighbour
    corner: Floats  # (n_vertices, 2) arm at rest, mm
    centroid: Floats  # (n_units, 2) at rest, mm
    radius: Floats  # (n_units,) longest arm, mm
    energy: float  # scale of the barrier, N mm
    per_stiffness: float  # its derivative by the contact stiffness of a single ligament, rad^2
    distance: float  # activation distance, mm
    reach: float  # distance up to which the sweep finds pairs, mm
    margin: float  # motion of a unit after which it is repeated, mm
    cache: NeighbourCache  # scratch


@compiled
def place_vertices(motion: Floats, contacts: ContactArrays) -> None:
    """Notes the positions of all vertices and centroids in a state."""
    cache = contacts.cache
    for unit in range(len(contacts.radius)):
        c, s = math.cos(motion[3 * unit + 2]), math.sin(motion[3 * unit + 2])
        x = contacts.centroid[unit, 0] + motion[3 * unit]
        y = contacts.centroid[unit, 1] + motion[3 * unit + 1]
        cache.centre[unit, 0], cache.centre[unit, 1] = x, y
        for v in range(contacts.first[unit], contacts.first[unit + 1]):
            rx, ry = contacts.corner[v, 0], contacts.corner[v, 1]
            cache.place[v, 0] = x + c * rx - s * ry
            cache.place[v, 1] = y + s * rx + c * ry


@compiled
def _square_to_edge(v: int, p: int, q: int, place: Floats) -> float:
    """Squared distance of vertex ``v`` to the edge from ``p`` to ``q``."""
    ex, ey = place[q, 0] - place[p, 0], place[q, 1] - place[p, 1]
    dx, dy = place[v, 0] - place[p, 0], place[v, 1] - place[p, 1]
    along = min(max((dx * ex + dy * ey) / (ex * ex + ey * ey), 0.0), 1.0)
    dx -= along * ex
    dy -= along * ey
    return dx * dx + dy * dy


@compiled
def is_inside(v: int, unit: int, contacts: ContactArrays) -> bool:
    """Tests if vertex ``v`` lies inside a unit, by the parity of the edges to its right."""
    place, inside = contacts.cache.place, False
    x, y = place[v, 0], place[v, 1]
    for p in range(contacts.first[unit], contacts.first[unit + 1]):
        q = contacts.following[p]
        if (place[p, 1] > y) != (place[q, 1] > y):
            share = (y - place[p, 1]) / (place[q, 1] - place[p, 1])
            if x < place[p, 0] + share * (place[q, 0] - place[p, 0]):
                inside = not inside
    return inside


@compiled
def _side(p: int, q: int, v: int, place: Floats) -> bool:
    """Tests if vertex ``v`` lies to the left of the line from ``p`` to ``q``."""
    ex, ey = place[q, 0] - place[p, 0], place[q, 1] - place[p, 1]
    return ex * (place[v, 1] - place[p, 1]) > ey * (place[v, 0] - place[p, 0])


@compiled
def crosses(v: int, unit: int, contacts: ContactArrays) -> bool:
    """Tests if the edge that starts at ``v`` crosses one of a unit's."""
    place, w = contacts.cache.place, contacts.following[v]
    for p in range(contacts.first[unit], contacts.first[unit + 1]):
        q = contacts.following[p]
        apart = _side(v, w, p, place) == _side(v, w, q, place)
        if not apart and _side(p, q, v, place) != _side(p, q, w, place):
            return True
    return False


@compiled
def gap_between(a: int, b: int, contacts: ContactArrays) -> float:
    """Distance of the outlines of two units, zero if they cross."""
    smallest = np.inf
    for one, other in ((a, b), (b, a)):
        for v in range(contacts.first[one], contacts.first[one + 1]):
            if one == a and crosses(v, other, contacts):
                return 0.0
            for p in range(contacts.first[other], contacts.first[other + 1]):
                q = contacts.following[p]
                smallest = min(smallest, _square_to_edge(v, p, q, contacts.cache.place))
    return math.sqrt(smallest)
