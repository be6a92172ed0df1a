"""Compiles contact on the angle of the voids: energy, gradient, tangent, mixed derivatives.

Derived by hand from sim/energy/ligament.py and tested against its automatic derivatives. Units are
rigid, so
the two voids beside a ligament open and close with the rotation of its first unit against its
second, the "turn".
"""

import numpy as np

from sim.core import Floats, Ints, compiled
from sim.energy.network_arrays import NetworkArrays, Sensitivity
from sim.linalg import Matrix, add


@compiled
def void_slopes(net: NetworkArrays, k: int, side: int, turn: float) -> tuple[float, float, float]:
    """Energy of one void and its first two derivatives by the turn; infinite past the barrier."""
    sign = 1.0 - 2.0 * side
    stiffness, barrier, cutoff = net.contact[k]
    angle = net.void[k, side] + sign * turn
    if angle >= cutoff:
        return 0.0, 0.0, 0.0
    # E = k w^2 x^2 / (2 (1 - x^2)) with x = (angle - cutoff) / w and w = cutoff - barrier
    width = cutoff - barrier
    x = (angle - cutoff) / width
    if x <= -1.0:
        return np.inf, 0.0, 0.0
    rest = 1.0 - x * x
    scale = 0.5 * stiffness
    return (
        scale * width * width * x * x / rest,
        sign * scale * width * 2.0 * x / (rest * rest),
        scale * (2.0 + 6.0 * x * x) / (rest * rest * rest),
    )


@compiled
def _curvature(net: NetworkArrays, k: int, turn: float) -> float:
    """Second derivative of the energy of both voids by the turn."""
    return void_slopes(net, k, 0, turn)[2] + void_slopes(net, k, 1, turn)[2]


@compiled
def add_gradient(motion: Floats, net: NetworkArrays, out: Floats) -> float:
    """Adds the gradient to ``out`` (3 n_units,); returns the contact energy, N mm."""
    total = 0.0
    for k in net.touching:
        a, b = 3 * net.unit[k, 0] + 2, 3 * net.unit[k, 1] + 2
        for side in range(2):
            energy, slope, _ = void_slopes(net, k, side, motion[a] - motion[b])
            total += energy
            out[a] += slope
            out[b] -= slope
    return total


@compiled
def add_tangent(motion: Floats, net: NetworkArrays, free: Ints, matrix: Matrix) -> None:
    """Adds the Hessian among the free dofs to a matrix."""
    for k in net.touching:
        a, b = 3 * net.unit[k, 0] + 2, 3 * net.unit[k, 1] + 2
        curvature = _curvature(net, k, motion[a] - motion[b])
        if curvature > 0.0:
            add(matrix, free[a], free[a], curvature)
            add(matrix, free[b], free[b], curvature)
            add(matrix, free[a], free[b], -curvature)


@compiled
def add_hessian_product(motion: Floats, net: NetworkArrays, direction: Floats, out: Floats) -> None:
    """Adds the Hessian times ``direction`` to ``out`` (3 n_units,)."""
    for k in net.touching:
        a, b = 3 * net.unit[k, 0] + 2, 3 * net.unit[k, 1] + 2
        moment = _curvature(net, k, motion[a] - motion[b]) * (direction[a] - direction[b])
        out[a] += moment
        out[b] -= moment


@compiled
def add_mixed(
    motion: Floats, net: NetworkArrays, direction: Floats, which: Ints, out: Sensitivity
) -> None:
    """Adds d/dp of (``direction`` . dE/dmotion) to ``out`` for the ligaments in ``which``."""
    if len(net.touching) == 0:
        return
    for k in which:
        a, b = 3 * net.unit[k, 0] + 2, 3 * net.unit[k, 1] + 2
        turning = direction[a] - direction[b]
        for side in range(2):
            _, slope, curvature = void_slopes(net, k, side, motion[a] - motion[b])
            if curvature > 0.0:
                out.void[k, side] += (1.0 - 2.0 * side) * curvature * turning
                out.contact[k] += slope / net.contact[k, 0] * turning


@compiled
def barrier_step(motion: Floats, net: NetworkArrays, step: Floats) -> float:
    """Largest multiple of ``step`` (3 n_units,) before a void reaches its barrier; exact."""
    largest = np.inf
    for k in net.touching:
        a, b = 3 * net.unit[k, 0] + 2, 3 * net.unit[k, 1] + 2
        turn, turning = motion[a] - motion[b], step[a] - step[b]
        if turning < 0.0:
            room = net.void[k, 0] + turn - net.contact[k, 1]
            largest = min(largest, room / -turning)
        elif turning > 0.0:
            room = net.void[k, 1] - turn - net.contact[k, 1]
            largest = min(largest, room / turning)
    return largest
