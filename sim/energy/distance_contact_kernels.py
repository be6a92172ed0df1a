"""Compiles contact of units on their distance: energy, gradient, tangent, mixed derivatives.

Derived by hand from sim/energy/distance_contact.py and tested against its automatic derivatives.
Units are rigid,
so each term is a function of where its vertex v lies in the frame of the other unit b: with g its
gradient by v, r_a and r_b the arms of v from the two centroids, and J a quarter turn,

    dE/d(u_a, theta_a, u_b, theta_b) = (g, J r_a . g, -g, -J r_b . g).

The term of an edge is a function of the vertex's distance s outside its line and its position x
along it; with t and n the edge's direction and outer normal g = E_s n + E_x t.
"""

import math

import numpy as np

from sim.collision import ContactArrays, find, term
from sim.core import Floats, Ints, compiled
from sim.energy.network_arrays import Sensitivity
from sim.linalg import Matrix, add


@compiled
def _barrier(square: float, contacts: ContactArrays) -> tuple[float, float, float]:
    """Barrier at a squared distance, and its first two derivatives by that."""
    # E = energy (1 - q)^3 / q with q = square / distance^2
    unit = contacts.distance * contacts.distance
    q, energy = square / unit, contacts.energy
    return (
        energy * (1.0 - q) ** 3 / q,
        energy / unit * (3.0 - 2.0 * q - 1.0 / (q * q)),
        energy / (unit * unit) * (2.0 / (q * q * q) - 2.0),
    )


@compiled
def _fade(length: float, distance: float) -> tuple[float, float, float]:
    """Weight at a length from the end of an edge, and its first two derivatives."""
    # w = 10 x^3 - 15 x^4 + 6 x^5 with x = length / distance
    x = length / distance
    if x >= 1.0:
        return 1.0, 0.0, 0.0
    return (
        x * x * x * (10.0 - 15.0 * x + 6.0 * x * x),
        30.0 * x * x * (1.0 - x) * (1.0 - x) / distance,
        60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (distance * distance),
    )


@compiled
def _frame(
    v: int, p: int, q: int, contacts: ContactArrays
) -> tuple[float, float, float, float, float]:
    """Direction of an edge, its length, and the vertex's distance s and position x."""
    place = contacts.cache.place
    ex, ey = place[q, 0] - place[p, 0], place[q, 1] - place[p, 1]
    length = math.sqrt(ex * ex + ey * ey)
    tx, ty = ex / length, ey / length
    dx, dy = place[v, 0] - place[p, 0], place[v, 1] - place[p, 1]
    return tx, ty, length, dx * ty - dy * tx, dx * tx + dy * ty


@compiled
def _edge_slopes(
    s: float, x: float, length: float, contacts: ContactArrays
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Energy of a vertex and an edge, and its derivatives s, x, l, ss, sx, xx, sl, xl."""
    # E = w(x) w(l - x) B(s^2)
    energy, by_square, twice = _barrier(s * s, contacts)
    one, d_one, dd_one = _fade(x, contacts.distance)
    two, d_two, dd_two = _fade(length - x, contacts.distance)
    weight, rising = one * two, d_one * two - one * d_two
    bent = dd_one * two - 2.0 * d_one * d_two + one * dd_two
    slope, curvature = 2.0 * s * by_square, 2.0 * by_square + 4.0 * s * s * twice
    return (
        weight * energy,
        weight * slope,
        rising * energy,
        one * d_two * energy,
        weight * curvature,
        rising * slope,
        bent * energy,
        one * d_two * slope,
        (d_one * d_two - one * dd_two) * energy,
    )


@compiled
def _vertex_slopes(
    v: int, p: int, contacts: ContactArrays
) -> tuple[float, float, float, float, float, float]:
    """Energy of two vertices, its gradient (x, y) and Hessian (xx, xy, yy) by the first."""
    place = contacts.cache.place
    dx, dy = place[v, 0] - place[p, 0], place[v, 1] - place[p, 1]
    energy, slope, twice = _barrier(dx * dx + dy * dy, contacts)
    slope, twice = 2.0 * slope, 4.0 * twice
    return (
        energy,
        slope * dx,
        slope * dy,
        slope + twice * dx * dx,
        twice * dx * dy,
        slope + twice * dy * dy,
    )


@compiled
def _slopes(
    v: int, p: int, q: int, contacts: ContactArrays
) -> tuple[float, float, float, float, float, float]:
    """Energy of a term, its gradient (x, y) and Hessian (xx, xy, yy) by the vertex."""
    if q < 0:
        return _vertex_slopes(v, p, contacts)
    tx, ty, length, s, x = _frame(v, p, q, contacts)
    energy, by_s, by_x, _, ss, sx, xx, _, _ = _edge_slopes(s, x, length, contacts)
    return (
        energy,
        by_s * ty + by_x * tx,
        -by_s * tx + by_x * ty,
        ss * ty * ty + 2.0 * sx * tx * ty + xx * tx * tx,
        -ss * tx * ty + sx * (ty * ty - tx * tx) + xx * tx * ty,
        ss * tx * tx - 2.0 * sx * tx * ty + xx * ty * ty,
    )


@compiled
def _arms(v: int, a: int, b: int, contacts: ContactArrays) -> tuple[float, float, float, float]:
    """Arms of a vertex from the centroids of its own unit and of the other."""
    x, y = contacts.cache.place[v, 0], contacts.cache.place[v, 1]
    centre = contacts.cache.centre
    return x - centre[a, 0], y - centre[a, 1], x - centre[b, 0], y - centre[b, 1]


@compiled
def add_gradient(motion: Floats, contacts: ContactArrays, out: Floats) -> float:
    """Adds the energy gradient to ``out`` (n_dofs,); returns the energy, infinite on overlap."""
    count = find(motion, contacts)
    if count < 0:
        return np.inf
    total = 0.0
    for k in range(count):
        v, p, q = term(k, contacts)
        a, b = contacts.owner[v], contacts.owner[p]
        energy, gx, gy, _, _, _ = _slopes(v, p, q, contacts)
        ax, ay, bx, by = _arms(v, a, b, contacts)
        total += energy
        out[3 * a] += gx
        out[3 * a + 1] += gy
        out[3 * a + 2] += ax * gy - ay * gx
        out[3 * b] -= gx
        out[3 * b + 1] -= gy
        out[3 * b + 2] -= bx * gy - by * gx
    return total


@compiled
def _block(v: int, p: int, q: int, a: int, b: int, contacts: ContactArrays, block: Floats) -> None:
    """Fills the lower half of the Hessian (6, 6) of a term in the dofs of its two units."""
    _, gx, gy, xx, xy, yy = _slopes(v, p, q, contacts)
    ax, ay, bx, by = _arms(v, a, b, contacts)
    # how the vertex moves in the other unit's frame, by each dof
    moves = ((1.0, 0.0), (0.0, 1.0), (-ay, ax), (-1.0, 0.0), (0.0, -1.0), (by, -bx))
    for row in range(6):
        mx, my = moves[row]
        hx, hy = xx * mx + xy * my, xy * mx + yy * my
        for column in range(row + 1):
            nx, ny = moves[column]
            block[row, column] = hx * nx + hy * ny
    block[2, 2] -= gx * ax + gy * ay
    block[5, 5] -= gx * bx + gy * by
    block[5, 0] -= gy
    block[5, 1] += gx
    block[5, 2] += gx * ax + gy * ay
    block[5, 3] += gy
    block[5, 4] -= gx


@compiled
def add_tangent(motion: Floats, contacts: ContactArrays, free: Ints, matrix: Matrix) -> None:
    """Adds the Hessian among the free dofs to a matrix (as ``kernels.tangent``)."""
    block, place = np.empty((6, 6)), np.empty(6, dtype=np.int64)
    for k in range(find(motion, contacts)):
        v, p, q = term(k, contacts)
        a, b = contacts.owner[v], contacts.owner[p]
        _block(v, p, q, a, b, contacts, block)
        for m in range(3):
            place[m], place[3 + m] = free[3 * a + m], free[3 * b + m]
        for row in range(6):
            for column in range(row + 1):
                add(matrix, place[row], place[column], block[row, column])


@compiled
def _rates(
    v: int, p: int, q: int, direction: Floats, contacts: ContactArrays
) -> tuple[float, float, float, float]:
    """Differentiates a term's vertex in the other unit's frame, and its gradient."""
    a, b = contacts.owner[v], contacts.owner[p]
    _, gx, gy, xx, xy, yy = _slopes(v, p, q, contacts)
    ax, ay, bx, by = _arms(v, a, b, contacts)
    la, lb = direction[3 * a + 2], direction[3 * b + 2]
    mx = direction[3 * a] - direction[3 * b] - la * ay + lb * by
    my = direction[3 * a + 1] - direction[3 * b + 1] + la * ax - lb * bx
    return mx, my, xx * mx + xy * my - lb * gy, xy * mx + yy * my + lb * gx


@compiled
def add_hessian_product(
    motion: Floats, contacts: ContactArrays, direction: Floats, out: Floats
) -> None:
    """Adds the Hessian times ``direction`` to ``out`` (n_dofs,), over all dofs."""
    for k in range(find(motion, contacts)):
        v, p, q = term(k, contacts)
        a, b = contacts.owner[v], contacts.owner[p]
        _, gx, gy, _, _, _ = _slopes(v, p, q, contacts)
        ax, ay, bx, by = _arms(v, a, b, contacts)
        mx, my, rx, ry = _rates(v, p, q, direction, contacts)
        la, lb = direction[3 * a + 2], direction[3 * b + 2]
        out[3 * a] += rx
        out[3 * a + 1] += ry
        out[3 * a + 2] += ax * ry - ay * rx - la * (ax * gx + ay * gy)
        out[3 * b] -= rx
        out[3 * b + 1] -= ry
        # the arm r_b changes by the vertex's motion in b's frame, and turns with b
        mx, my = mx - lb * by, my + lb * bx
        out[3 * b + 2] -= bx * ry - by * rx + mx * gy - my * gx


@compiled
def _add_point(
    vertex: int, slope: tuple[float, float], rate: tuple[float, float], turn: Floats,
    direction: Floats, contacts: ContactArrays, out: Sensitivity,
) -> None:  # fmt: skip
    """Adds what the slope of a term by one vertex, and its rate, give its arm and centroid."""
    (gx, gy), (rx, ry) = slope, rate
    unit = contacts.owner[vertex]
    c, s, spin = turn[unit, 0], turn[unit, 1], direction[3 * unit + 2]
    hx, hy = rx + spin * gy, ry - spin * gx
    out.corner[vertex, 0] += c * hx + s * hy
    out.corner[vertex, 1] += -s * hx + c * hy
    out.centroid[unit, 0] += rx
    out.centroid[unit, 1] += ry


@compiled
def _end_slopes(
    v: int, p: int, q: int, mx: float, my: float, spin: float, contacts: ContactArrays
) -> tuple[float, float, float, float]:
    """Gradient of an edge's term by its end, and its rate.

    The vertex `v` moves by `mx`, `my` in the frame of the edge from `p` to `q`, which turns at the
    rate `spin`.
    """
    tx, ty, length, s, x = _frame(v, p, q, contacts)
    nx, ny = ty, -tx
    _, by_s, by_x, by_l, ss, sx, xx, sl, xl = _edge_slopes(s, x, length, contacts)
    ds, dx = nx * mx + ny * my, tx * mx + ty * my
    lever = (s * by_x - x * by_s) / length
    d_lever = ds * by_x + s * (sx * ds + xx * dx) - dx * by_s - x * (ss * ds + sx * dx)
    d_lever = d_lever / length - spin * by_l
    d_length = sl * ds + xl * dx + spin * lever
    return (
        lever * nx + by_l * tx,
        lever * ny + by_l * ty,
        d_lever * nx + d_length * tx,
        d_lever * ny + d_length * ty,
    )


@compiled
def add_mixed(
    motion: Floats, contacts: ContactArrays, turn: Floats, direction: Floats, out: Sensitivity
) -> None:
    """Adds d/dp of (``direction`` . dE/dmotion), p the arms, centroids and contact stiffnesses.

    ``turn`` holds cos and sin of all rotations.
    """
    by_energy = 0.0
    for k in range(find(motion, contacts)):
        v, p, q = term(k, contacts)
        _, gx, gy, _, _, _ = _slopes(v, p, q, contacts)
        mx, my, rx, ry = _rates(v, p, q, direction, contacts)
        by_energy += gx * mx + gy * my
        _add_point(v, (gx, gy), (rx, ry), turn, direction, contacts, out)
        if q >= 0:
            spin = direction[3 * contacts.owner[p] + 2]
            ex, ey, fx, fy = _end_slopes(v, p, q, mx, my, spin, contacts)
            _add_point(q, (ex, ey), (fx, fy), turn, direction, contacts, out)
            gx, gy, rx, ry = gx + ex, gy + ey, rx + fx, ry + fy
        _add_point(p, (-gx, -gy), (-rx, -ry), turn, direction, contacts, out)
    # the scale of the energy is proportional to the mean contact stiffness
    for k in range(len(out.contact)):
        out.contact[k] += by_energy * contacts.per_stiffness / contacts.energy
