"""Limits a step so that no units pass through each other: compiled, by safe advances.

Two outlines that do not cross can only come to cross where a vertex of one meets an edge of the
other. In the frame of the edge's unit the vertex moves on a smooth curve, whose curvature is
bounded; as long as it stays on the far side of one of the lines that bound the edge's neighbourhood
(the edge's own, and its normals at both ends) it does not meet the edge. The step is advanced as
far as that bound vouches for, again and again, until a meeting is close or the step's end reached.
"""

import math

import numpy as np

from sim.collision.neighbour_list import find
from sim.collision.polygons import ContactArrays
from sim.core import Floats, compiled

FAR = 1.2
"""Multiples of a step that are looked at: somewhat more than solvers keep of the limit."""
CLOSE = 0.02
"""A meeting is close once an advance adds less than this to the multiple reached."""
MAX_ADVANCES = 200


@compiled
def _advance(value: float, slope: float, curvature: float) -> float:
    """Bounds how far a positive value with this slope stays so, by its second derivative."""
    root = math.sqrt(slope * slope + 2.0 * curvature * value)
    if slope < 0.0:
        return 2.0 * value / (root - slope)
    return (slope + root) / curvature if curvature > 0.0 else np.inf


@compiled
def _past_edge(
    y: tuple[float, float], dy: tuple[float, float], curvature: float,
    edge: tuple[float, float, float, float, float],
) -> float:  # fmt: skip
    """Advance of a point at ``y`` with velocity ``dy`` that surely does not meet an edge.

    The edge is given by its start, direction and length.
    """
    px, py, tx, ty, length = edge
    x, dx = (y[0] - px) * tx + (y[1] - py) * ty, dy[0] * tx + dy[1] * ty
    s, ds = (y[0] - px) * ty - (y[1] - py) * tx, dy[0] * ty - dy[1] * tx
    safe = _advance(s, ds, curvature) if s > 0.0 else 0.0
    if s < 0.0:
        safe = _advance(-s, -ds, curvature)
    if x < 0.0:
        safe = max(safe, _advance(-x, -dx, curvature))
    if x > length:
        safe = max(safe, _advance(x - length, dx, curvature))
    return safe


@compiled
def _at(
    multiple: float, w: tuple[float, float], d: tuple[float, float], r: tuple[float, float],
    spin: float, relative: float,
) -> tuple[tuple[float, float], tuple[float, float]]:  # fmt: skip
    """Place and velocity of a vertex in the other unit's frame at a multiple of the step.

    `w` leads from the other unit's centroid to its own at the step's start and changes by `d`, `r`
    from its own to the vertex; `spin` is the rotation of the other unit, `relative` its own
    relative to that.
    """
    cb, sb = math.cos(multiple * spin), math.sin(multiple * spin)
    cr, sr = math.cos(multiple * relative), math.sin(multiple * relative)
    wx, wy = w[0] + multiple * d[0], w[1] + multiple * d[1]
    vx, vy = d[0] + spin * wy, d[1] - spin * wx
    rx, ry = cr * r[0] - sr * r[1], sr * r[0] + cr * r[1]
    return (
        (cb * wx + sb * wy + rx, -sb * wx + cb * wy + ry),
        (cb * vx + sb * vy - relative * ry, -sb * vx + cb * vy + relative * rx),
    )


@compiled
def _pass_unit(
    one: int, other: int, largest: float, step: Floats, contacts: ContactArrays
) -> float:
    """``largest``, or less: the multiple up to which no vertex of ``one`` meets ``other``."""
    centre, place = contacts.cache.centre, contacts.cache.place
    w = (centre[one, 0] - centre[other, 0], centre[one, 1] - centre[other, 1])
    d = (step[3 * one] - step[3 * other], step[3 * one + 1] - step[3 * other + 1])
    spin = step[3 * other + 2]
    relative = step[3 * one + 2] - spin
    apart, drift = math.hypot(w[0], w[1]), math.hypot(d[0], d[1])
    bent = relative * relative * contacts.radius[one]
    bent += abs(spin) * (2.0 * drift + abs(spin) * (apart + largest * drift))
    speed = math.hypot(d[0] + spin * w[1], d[1] - spin * w[0])
    speed += abs(relative) * contacts.radius[one] + FAR * bent
    far = contacts.radius[other] + largest * speed
    for v in range(contacts.first[one], contacts.first[one + 1]):
        x, y = place[v, 0] - centre[other, 0], place[v, 1] - centre[other, 1]
        if x * x + y * y > far * far:
            continue
        r = (place[v, 0] - centre[one, 0], place[v, 1] - centre[one, 1])
        for p in range(contacts.first[other], contacts.first[other + 1]):
            largest = _pass_edge(p, other, largest, (w, d, r), (spin, relative, bent), contacts)
    return largest


@compiled
def _pass_edge(
    p: int, other: int, largest: float,
    path: tuple[tuple[float, float], tuple[float, float], tuple[float, float]],
    turning: tuple[float, float, float], contacts: ContactArrays,
) -> float:  # fmt: skip
    """``largest``, or less: the multiple up to which a vertex does not meet the edge from ``p``.

    ``path`` is w, d, r and ``turning`` the spins of ``_at`` with the bound of the curvature.
    """
    place, centre, q = contacts.cache.place, contacts.cache.centre, contacts.following[p]
    (w, d, r), (spin, relative, bent) = path, turning
    ex, ey = place[q, 0] - place[p, 0], place[q, 1] - place[p, 1]
    length = math.sqrt(ex * ex + ey * ey)
    px, py = place[p, 0] - centre[other, 0], place[p, 1] - centre[other, 1]
    edge = (px, py, ex / length, ey / length, length)
    y = (w[0] + r[0], w[1] + r[1])
    dy = (d[0] + spin * w[1] - relative * r[1], d[1] - spin * w[0] + relative * r[0])
    reached = 0.0
    for _ in range(MAX_ADVANCES):
        safe = _past_edge(y, dy, bent, edge)
        reached += safe
        if reached >= largest:
            return largest
        if safe <= CLOSE * reached:
            break
        y, dy = _at(reached, w, d, r, spin, relative)
    return reached


@compiled
def collision_free_step(motion: Floats, contacts: ContactArrays, step: Floats) -> float:
    """Multiple of ``step`` (n_dofs,) up to which no two units meet; inf if beyond FAR."""
    if find(motion, contacts) < 0:
        return 0.0
    cache, fastest = contacts.cache, 0.0
    sway = np.empty(len(contacts.radius))
    for unit in range(len(sway)):
        sway[unit] = math.hypot(step[3 * unit], step[3 * unit + 1])
        sway[unit] += contacts.radius[unit] * abs(step[3 * unit + 2])
        fastest = max(fastest, cache.moved[unit] + FAR * sway[unit])
    largest = FAR
    if 2.0 * fastest > cache.room[0]:  # new pairs meet no sooner than this
        largest = _room_for_new_pairs(sway, contacts)
    for k in range(len(contacts.pairs)):
        a, b = contacts.pairs[k, 0], contacts.pairs[k, 1]
        gap = cache.gap[k] - cache.moved[a] - cache.moved[b]
        if gap < largest * (sway[a] + sway[b]):
            largest = _pass_unit(a, b, largest, step, contacts)
            largest = _pass_unit(b, a, largest, step, contacts)
    return np.inf if largest == FAR else largest


@compiled
def _room_for_new_pairs(sway: Floats, contacts: ContactArrays) -> float:
    cache = contacts.cache
    left = cache.room[0] - 2.0 * cache.moved.max()
    return min(FAR, max(left, 0.0) / max(2.0 * sway.max(), 1e-300))
