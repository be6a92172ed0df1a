"""Searches vertices and edges within the reach of contact: compiled, conservative.

The broad phase sweeps all units and notes the gap of each pair of them that may meet. The gap of a
pair shrinks by no more than its units have moved since, so most pairs are skipped without a look at
their vertices; once any unit has moved by ``margin``, the sweep is repeated. Pairs whose coupling
the tangent has no room for ("new pairs") are noted before they come within reach: the state then
counts as not admissible, and the solve goes on, or is repeated, with more room.
"""

import math

import numpy as np

from sim.collision.polygons import ContactArrays, crosses, gap_between, is_inside, place_vertices
from sim.core import Floats, Ints, compiled, inlined

MAX_NEW_PAIRS = 256
TERMS_PER_VERTEX = 16


@compiled
def _position(a: int, b: int, pairs: Ints) -> int:
    """Row of the units ``a`` < ``b`` among the pairs, -1 if they are none."""
    low, high = 0, len(pairs)
    while low < high:
        middle = (low + high) // 2
        if pairs[middle, 0] < a or (pairs[middle, 0] == a and pairs[middle, 1] < b):
            low = middle + 1
        else:
            high = middle
    return low if low < len(pairs) and pairs[low, 0] == a and pairs[low, 1] == b else -1


@compiled
def _note(a: int, b: int, contacts: ContactArrays) -> None:
    """Notes the gap of two units nearer than the reach."""
    cache = contacts.cache
    gap = min(gap_between(a, b, contacts), contacts.reach)
    row = _position(a, b, contacts.pairs)
    if row >= 0:
        cache.gap[row] = gap
        return
    cache.room[0] = min(cache.room[0], gap)
    if gap < contacts.distance + 2.0 * contacts.margin and cache.found[1] < MAX_NEW_PAIRS:
        cache.new_pairs[cache.found[1], 0], cache.new_pairs[cache.found[1], 1] = a, b
        cache.found[1] += 1


@compiled
def _sweep(contacts: ContactArrays) -> None:
    """Notes the gaps of all pairs of units, in the order of their left ends."""
    cache, radius = contacts.cache, contacts.radius
    cache.gap[:] = contacts.reach
    cache.room[0] = contacts.reach
    left = cache.centre[:, 0] - radius
    order = np.argsort(left)
    for i in range(len(order)):
        one = order[i]
        end = cache.centre[one, 0] + radius[one] + contacts.reach
        for j in range(i + 1, len(order)):
            other = order[j]
            if left[other] > end:
                break
            dx = cache.centre[other, 0] - cache.centre[one, 0]
            dy = cache.centre[other, 1] - cache.centre[one, 1]
            within = radius[one] + radius[other] + contacts.reach
            if dx * dx + dy * dy < within * within:
                _note(min(one, other), max(one, other), contacts)


@compiled
def _follow_motion(motion: Floats, contacts: ContactArrays) -> None:
    """Bounds the motion since the last sweep; repeats it where that is due."""
    cache = contacts.cache
    largest = 0.0
    for unit in range(len(contacts.radius)):
        dx = motion[3 * unit] - cache.searched[3 * unit]
        dy = motion[3 * unit + 1] - cache.searched[3 * unit + 1]
        turn = abs(motion[3 * unit + 2] - cache.searched[3 * unit + 2])
        cache.moved[unit] = math.sqrt(dx * dx + dy * dy) + contacts.radius[unit] * turn
        largest = max(largest, cache.moved[unit])
    if not largest <= contacts.margin:
        cache.searched[:] = motion
        cache.moved[:] = 0.0
        _sweep(contacts)


@compiled
def _append(v: int, p: int, q: int, contacts: ContactArrays) -> None:
    cache = contacts.cache
    if cache.found[0] == len(cache.terms):  # more than units with edges of any length can have
        cache.found[0] = -1
    if cache.found[0] >= 0:
        term = cache.terms[cache.found[0]]
        term[0], term[1], term[2] = v, p, q
        cache.found[0] += 1


@compiled
def _append_near(v: int, unit: int, with_vertices: bool, contacts: ContactArrays) -> None:
    """Appends the terms of vertex ``v`` with the edges, and vertices, of a unit."""
    place, reach = contacts.cache.place, contacts.distance
    for p in range(contacts.first[unit], contacts.first[unit + 1]):
        q = contacts.following[p]
        ex, ey = place[q, 0] - place[p, 0], place[q, 1] - place[p, 1]
        dx, dy = place[v, 0] - place[p, 0], place[v, 1] - place[p, 1]
        if with_vertices and dx * dx + dy * dy < reach * reach:
            _append(v, p, -1, contacts)
        square, along, across = ex * ex + ey * ey, dx * ex + dy * ey, dx * ey - dy * ex
        if 0.0 < along < square and across > 0.0 and across * across < reach * reach * square:
            _append(v, p, q, contacts)


@compiled
def _collect(contacts: ContactArrays) -> None:
    """Lists the terms of all pairs within reach; none, and -1, if two units overlap."""
    cache = contacts.cache
    cache.found[0] = 0
    for k in range(len(contacts.pairs)):
        a, b = contacts.pairs[k, 0], contacts.pairs[k, 1]
        if cache.gap[k] - cache.moved[a] - cache.moved[b] >= contacts.distance:
            continue
        for one, other in ((a, b), (b, a)):
            far = contacts.radius[other] + contacts.distance
            for v in range(contacts.first[one], contacts.first[one + 1]):
                dx = cache.place[v, 0] - cache.centre[other, 0]
                dy = cache.place[v, 1] - cache.centre[other, 1]
                if dx * dx + dy * dy >= far * far:
                    continue
                if is_inside(v, other, contacts) or crosses(v, other, contacts):
                    cache.found[0], cache.overlap[0], cache.overlap[1] = -1, a, b
                    return
                _append_near(v, other, one == a, contacts)


@compiled
def is_same(one: Floats, other: Floats) -> bool:
    """Compares two states number by number."""
    d = 0
    while d < len(one) and one[d] == other[d]:
        d += 1
    return d == len(one)


@inlined
def units_met(contacts: ContactArrays) -> bool:
    """Tells whether units met for whose coupling the tangent has no room."""
    return contacts.cache.found[1] > 0


@compiled
def find(motion: Floats, contacts: ContactArrays) -> int:
    """Lists the vertices and edges in contact in a state (n_dofs,) in ``cache.terms``.

    Returns:
        their number, or -1 if units overlap or a new pair comes close.
    """
    cache = contacts.cache
    if not is_same(motion, cache.state):
        cache.state[:] = motion
        place_vertices(motion, contacts)
        _follow_motion(motion, contacts)
        _collect(contacts)
    return -1 if units_met(contacts) else cache.found[0]


@compiled
def pairs_in_contact(motion: Floats, contacts: ContactArrays) -> int:
    """Number of pairs of units nearer than the activation distance in a state (n_dofs,)."""
    count, last_a, last_b = 0, -1, -1
    for k in range(find(motion, contacts)):  # the terms of a pair follow each other
        v, p, _ = term(k, contacts)
        a, b = min(contacts.owner[v], contacts.owner[p]), max(contacts.owner[v], contacts.owner[p])
        if a != last_a or b != last_b:
            count, last_a, last_b = count + 1, a, b
    return count


@compiled
def term(k: int, contacts: ContactArrays) -> tuple[int, int, int]:
    """Vertex, and start and end of the edge (-1: its start alone), of the ``k``-th term found."""
    row = contacts.cache.terms[k]
    return row[0], row[1], row[2]
