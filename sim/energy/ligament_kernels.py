"""Compiles loops over the ligaments: energy, gradient, tangent and mixed derivatives.

Derived by hand from sim/energy/ligament.py and tested against its automatic derivatives. With d the
current ligament vector, n and t its unit tangent and normal, L its length, gamma its shear angle,

    dW/dd = k_l (L - l0) n + k_s l0^2 gamma t / L,
    dW/dtheta = -k_s l0^2 gamma / 2 -+ k_theta kappa,

each strain taken from its natural value (zero but where a ligament is not free of stress at rest),
and the motions of the two units enter through

    d = vector + (u_b + R_b r_b - r_b) - (u_a + R_a r_a - r_a).

Second derivatives read the kinematics that ``gradient`` or ``locate`` left of the same state: sines
and arctangents are two thirds of their cost.
"""

import math

import numpy as np

from sim.core import Floats, Ints, compiled
from sim.energy.network_arrays import Kinematics, NetworkArrays, Sensitivity


@compiled
def _trigonometry(motion: Floats, turn: Floats) -> None:
    """Fills ``turn`` (n_units, 4): cos and sin of all rotations, then of their halves."""
    for unit in range(turn.shape[0]):
        half = 0.5 * motion[3 * unit + 2]
        c, s = math.cos(half), math.sin(half)
        turn[unit, 0] = (c - s) * (c + s)
        turn[unit, 1] = 2.0 * s * c
        turn[unit, 2] = c
        turn[unit, 3] = s


@compiled
def _rotated(
    motion: Floats, turn: Floats, net: NetworkArrays, k: int
) -> tuple[float, float, float, float, float, float]:
    """Rotated arms of ligament k, and its current vector."""
    a, b = net.unit[k, 0], net.unit[k, 1]
    ca, sa, cb, sb = turn[a, 0], turn[a, 1], turn[b, 0], turn[b, 1]
    pax = ca * net.arm[k, 0, 0] - sa * net.arm[k, 0, 1]
    pay = sa * net.arm[k, 0, 0] + ca * net.arm[k, 0, 1]
    pbx = cb * net.arm[k, 1, 0] - sb * net.arm[k, 1, 1]
    pby = sb * net.arm[k, 1, 0] + cb * net.arm[k, 1, 1]
    vx, vy = net.vector[k, 0], net.vector[k, 1]
    dx = vx + (motion[3 * b] + pbx - net.arm[k, 1, 0]) - (motion[3 * a] + pax - net.arm[k, 0, 0])
    dy = (
        vy
        + (motion[3 * b + 1] + pby - net.arm[k, 1, 1])
        - (motion[3 * a + 1] + pay - net.arm[k, 0, 1])
    )
    return pax, pay, pbx, pby, dx, dy


@compiled
def _shear(turn: Floats, net: NetworkArrays, k: int, dx: float, dy: float) -> float:
    """Shear angle of ligament k with the current vector d, from its natural value."""
    a, b = net.unit[k, 0], net.unit[k, 1]
    vx, vy = net.vector[k, 0], net.vector[k, 1]
    ch = turn[a, 2] * turn[b, 2] - turn[a, 3] * turn[b, 3]
    sh = turn[a, 3] * turn[b, 2] + turn[a, 2] * turn[b, 3]
    ex, ey = ch * vx - sh * vy, sh * vx + ch * vy
    # gamma: angle from the reference vector, turned by the mean of both rotations, to d
    return math.atan2(ex * dy - ey * dx, ex * dx + ey * dy) - net.natural[k, 1]


@compiled
def _lengths(
    motion: Floats, net: NetworkArrays, k: int, dx: float, dy: float
) -> tuple[float, float, float, float]:
    """Length and reference length of ligament k, its stretch and relative rotation.

    The latter are from their natural values.
    """
    a, b = net.unit[k, 0], net.unit[k, 1]
    vx, vy = net.vector[k, 0], net.vector[k, 1]
    length, reference = math.sqrt(dx * dx + dy * dy), math.sqrt(vx * vx + vy * vy)
    stretch = length - reference - net.natural[k, 0]
    bend = motion[3 * b + 2] - motion[3 * a + 2] - net.natural[k, 2]
    return length, reference, stretch, bend


@compiled
def locate(motion: Floats, net: NetworkArrays, kinematics: Kinematics) -> None:
    """Fills the kinematics of a state, as the second derivatives read them."""
    turn, shears = kinematics.turn, kinematics.shear
    _trigonometry(motion, turn)
    for k in range(net.unit.shape[0]):
        _, _, _, _, dx, dy = _rotated(motion, turn, net, k)
        shears[k] = _shear(turn, net, k, dx, dy)


@compiled
def _forces(
    net: NetworkArrays,
    k: int,
    dx: float,
    dy: float,
    length: float,
    rest: float,
    strain: tuple[float, float, float],
) -> tuple[float, float, float, float]:
    """dW/dd (2) and dW/dtheta of either unit at fixed d."""
    stretch, shear, bend = strain
    # dW/dd = k_l (l - l0) n + k_s l0^2 gamma t / l, with n along d and t across; M = k_b bend
    nx, ny = dx / length, dy / length
    tension = net.law[k, 0] * stretch
    torque = net.law[k, 1] * rest * rest * shear
    gx = tension * nx - torque * ny / length
    gy = tension * ny + torque * nx / length
    moment = net.law[k, 2] * bend
    return gx, gy, -0.5 * torque - moment, -0.5 * torque + moment


@compiled
def gradient(motion: Floats, net: NetworkArrays, kinematics: Kinematics, out: Floats) -> float:
    """Fills the energy gradient ``out`` (3 n_units,), and the kinematics.

    Returns:
        the strain energy, N mm.
    """
    turn, shears = kinematics.turn, kinematics.shear
    _trigonometry(motion, turn)
    out[:] = 0.0
    strain_energy = 0.0
    for k in range(net.unit.shape[0]):
        a, b = 3 * net.unit[k, 0], 3 * net.unit[k, 1]
        pax, pay, pbx, pby, dx, dy = _rotated(motion, turn, net, k)
        length, rest, stretch, bend = _lengths(motion, net, k, dx, dy)
        shear = _shear(turn, net, k, dx, dy)
        shears[k] = shear
        strain = stretch, shear, bend
        gx, gy, wa, wb = _forces(net, k, dx, dy, length, rest, strain)
        # W = k_l (l - l0)^2 / 2 + k_s (l0 gamma)^2 / 2 + k_b bend^2 / 2
        strain_energy += 0.5 * (
            net.law[k, 0] * stretch**2
            + net.law[k, 1] * (rest * shear) ** 2
            + net.law[k, 2] * bend * bend
        )
        out[a] -= gx
        out[a + 1] -= gy
        out[a + 2] += wa + gx * pay - gy * pax
        out[b] += gx
        out[b + 1] += gy
        out[b + 2] += wb - gx * pby + gy * pbx
    return strain_energy


@compiled
def _second(
    net: NetworkArrays,
    k: int,
    dx: float,
    dy: float,
    length: float,
    rest: float,
    strain: tuple[float, float, float],
) -> tuple[float, float, float, float, float]:
    """Second derivatives of W: d d (xx, xy, yy) and d theta (x, y); theta theta is constant."""
    # d2W = k_l n n' + (k_l (l - l0) / l + k_s l0^2 / l^2) t t' - k_s l0^2 gamma / l^2 (n t' + t n')
    nx, ny = dx / length, dy / length
    stretch, shear, _ = strain
    axial, torsion = net.law[k, 0], net.law[k, 1] * rest * rest
    along = axial
    across = axial * stretch / length + torsion / (length * length)
    mixed = -torsion * shear / (length * length)
    hxx = along * nx * nx + across * ny * ny - 2.0 * mixed * nx * ny
    hyy = along * ny * ny + across * nx * nx + 2.0 * mixed * nx * ny
    hxy = (along - across) * nx * ny + mixed * (nx * nx - ny * ny)
    return hxx, hxy, hyy, 0.5 * torsion * ny / length, -0.5 * torsion * nx / length


@compiled
def _ligament_block(
    k: int, motion: Floats, turn: Floats, shear: float, net: NetworkArrays, block: Floats
) -> None:
    """Fills the lower half of the Hessian (6, 6) of ligament ``k`` in the dofs of its two units."""
    pax, pay, pbx, pby, dx, dy = _rotated(motion, turn, net, k)
    length, rest, stretch, bend = _lengths(motion, net, k, dx, dy)
    strain = stretch, shear, bend
    gx, gy, _, _ = _forces(net, k, dx, dy, length, rest, strain)
    hxx, hxy, hyy, mx, my = _second(net, k, dx, dy, length, rest, strain)
    torsion, bending = 0.25 * net.law[k, 1] * rest * rest, net.law[k, 2]
    # dd/dtheta_a = (pay, -pax), dd/dtheta_b = (-pby, pbx)
    hax, hay = hxx * pay - hxy * pax, hxy * pay - hyy * pax
    hbx, hby = -hxx * pby + hxy * pbx, -hxy * pby + hyy * pbx
    across_a, across_b = mx * pay - my * pax, my * pbx - mx * pby
    block[0, 0] = block[3, 3] = hxx
    block[1, 0] = block[4, 3] = hxy
    block[1, 1] = block[4, 4] = hyy
    block[3, 0], block[3, 1], block[4, 0], block[4, 1] = -hxx, -hxy, -hxy, -hyy
    block[2, 0], block[2, 1] = -hax - mx, -hay - my
    block[3, 2], block[4, 2] = hax + mx, hay + my
    block[5, 0], block[5, 1] = -hbx - mx, -hby - my
    block[5, 3], block[5, 4] = hbx + mx, hby + my
    stiff = torsion + bending
    block[2, 2] = pay * hax - pax * hay + 2.0 * across_a + stiff + gx * pax + gy * pay
    block[5, 2] = pay * hbx - pax * hby + across_a + across_b + torsion - bending
    block[5, 5] = pbx * hby - pby * hbx + 2.0 * across_b + stiff - gx * pbx - gy * pby


@compiled
def tangent(
    motion: Floats, net: NetworkArrays, kinematics: Kinematics, entries: Ints, values: Floats
) -> None:
    """Adds the energy's Hessian among the free dofs to the values of a matrix.

    ``entries`` (n_ligaments, 21) are the places of each ligament's block (``block_entries``).
    """
    turn, shears = kinematics.turn, kinematics.shear
    block = np.empty((6, 6))
    for k in range(net.unit.shape[0]):
        _ligament_block(k, motion, turn, shears[k], net, block)
        m = 0
        for row in range(6):
            for column in range(row + 1):
                at = entries[k, m]
                m += 1
                if at >= 0:
                    values[at] += block[row, column]


@compiled
def hessian_product(
    motion: Floats, net: NetworkArrays, kinematics: Kinematics, direction: Floats, out: Floats
) -> None:
    """Fills ``out`` (3 n_units,) with the Hessian times ``direction``, over all dofs."""
    turn, shears = kinematics.turn, kinematics.shear
    out[:] = 0.0
    for k in range(net.unit.shape[0]):
        a, b = 3 * net.unit[k, 0], 3 * net.unit[k, 1]
        la, lb = direction[a + 2], direction[b + 2]
        pax, pay, pbx, pby, dx, dy = _rotated(motion, turn, net, k)
        length, rest, stretch, bend = _lengths(motion, net, k, dx, dy)
        strain = stretch, shears[k], bend
        gx, gy, _, _ = _forces(net, k, dx, dy, length, rest, strain)
        hxx, hxy, hyy, mx, my = _second(net, k, dx, dy, length, rest, strain)
        torsion = 0.25 * net.law[k, 1] * rest * rest
        bending = net.law[k, 2]
        ex = direction[b] - direction[a] - pby * lb + pay * la
        ey = direction[b + 1] - direction[a + 1] + pbx * lb - pax * la
        fx = hxx * ex + hxy * ey + mx * (la + lb)
        fy = hxy * ex + hyy * ey + my * (la + lb)
        common = mx * ex + my * ey + torsion * (la + lb)
        out[a] -= fx
        out[a + 1] -= fy
        out[a + 2] += (
            fx * pay - fy * pax + common + bending * (la - lb) + (gx * pax + gy * pay) * la
        )
        out[b] += fx
        out[b + 1] += fy
        out[b + 2] += (
            -fx * pby + fy * pbx + common + bending * (lb - la) - (gx * pbx + gy * pby) * lb
        )


@compiled
def mixed(
    motion: Floats,
    net: NetworkArrays,
    kinematics: Kinematics,
    direction: Floats,
    which: Ints,
    out: Sensitivity,
) -> None:
    """Adds d/dp of (``direction`` . dE/dmotion) to ``out`` for the ligaments in ``which``."""
    turn, shears = kinematics.turn, kinematics.shear
    for k in which:
        ua, ub = net.unit[k, 0], net.unit[k, 1]
        a, b = 3 * ua, 3 * ub
        la, lb = direction[a + 2], direction[b + 2]
        pax, pay, pbx, pby, dx, dy = _rotated(motion, turn, net, k)
        length, rest, stretch, bend = _lengths(motion, net, k, dx, dy)
        strain = stretch, shears[k], bend
        gx, gy, _, _ = _forces(net, k, dx, dy, length, rest, strain)
        hxx, hxy, hyy, mx, my = _second(net, k, dx, dy, length, rest, strain)
        ex = direction[b] - direction[a] - pby * lb + pay * la
        ey = direction[b + 1] - direction[a + 1] + pbx * lb - pax * la
        fx = hxx * ex + hxy * ey + mx * (la + lb)
        fy = hxy * ex + hyy * ey + my * (la + lb)
        ca, sa, cb, sb = turn[ua, 0], turn[ua, 1], turn[ub, 0], turn[ub, 1]
        # d moves by (I - R_a) dr_a and (R_b - I) dr_b; the arms also turn with the direction
        hx, hy = fx + la * gy, fy - la * gx
        out.arm[k, 0, 0] += fx - (ca * hx + sa * hy)
        out.arm[k, 0, 1] += fy - (-sa * hx + ca * hy)
        hx, hy = fx + lb * gy, fy - lb * gx
        out.arm[k, 1, 0] += cb * hx + sb * hy - fx
        out.arm[k, 1, 1] += -sb * hx + cb * hy - fy

        nx, ny = dx / length, dy / length
        stretch, shear, bend = strain
        stretching = nx * ex + ny * ey
        shearing = (nx * ey - ny * ex) / length - 0.5 * (la + lb)
        vx, vy = net.vector[k, 0], net.vector[k, 1]
        by_rest = -net.law[k, 0] * stretching + 2.0 * net.law[k, 1] * rest * shear * shearing
        by_direction = -net.law[k, 1] * shearing
        out.vector[k, 0] += fx + by_rest * vx / rest - by_direction * vy
        out.vector[k, 1] += fy + by_rest * vy / rest + by_direction * vx
        out.law[k, 0] += stretch * stretching
        out.law[k, 1] += rest * rest * shear * shearing
        out.law[k, 2] += bend * (lb - la)
        out.natural[k, 0] -= net.law[k, 0] * stretching
        out.natural[k, 1] -= net.law[k, 1] * rest * rest * shearing
        out.natural[k, 2] -= net.law[k, 2] * (lb - la)
