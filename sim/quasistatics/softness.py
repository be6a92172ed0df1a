"""Finds the softest point of a path of equilibria, and what it depends on.

Along a path the smallest eigenvalue of the tangent has a minimum lambda*. Where that is positive
the structure does not snap; where it is negative the path folds, and lambda* is taken on its
unstable part, which is followed by arc length. So lambda* is smooth in the design through the cusp
in which a fold appears, and a design may be led out of one by its derivatives:

    dlambda* = v . dK v    along any variation of the state, as dlambda / ds = 0 there.

Where contact sets in, the eigenvalue has a kink; its derivative is then that of the point in which
the branches on both sides meet.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from sim.collision import raise_new_pairs
from sim.core import Floats, NewContactPairs, SimulationError
from sim.energy import Topology, as_values, kinematics_of, locate, mixed
from sim.quasistatics.arc_length import ArcLengthPath, PathPoint
from sim.quasistatics.eigenvalue import mode_slopes
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters

POINTS = 150
"""Points of a path at most."""
RECOVERY = 0.5
"""Share of the smallest eigenvalue of a fold by which the next points show that it was passed."""
BRACKET = 1e-3
"""Share of the way between two neighbours of the softest point that its bracket is wide."""


class SoftestPoint(NamedTuple):
    """Holds the softest point of a part of a path."""

    load: float  # load parameter
    eigenvalue: float  # of the tangent, with rotations times the scale, N/mm; negative in a fold
    slopes: ConcreteParameters  # derivatives of the eigenvalue


class _LowestMode(NamedTuple):
    eigenvalue: float
    mode: Floats  # (n_free,) S v
    point: PathPoint


def softest_point(
    topology: Topology,
    values: ConcreteParameters,
    drive: PrescribedMotion,
    start: tuple[float, Floats],
    end: float,
) -> SoftestPoint | None:
    """Finds it from a stable equilibrium, of load parameter and state (n_dofs,), to a load.

    Of a path that folds it is the one of its first fold.

    Returns:
        the point; None if the path is softest at one of its ends.

    Raises:
        SimulationError: the tangent is exactly singular there.
    """
    try:
        return _find_softest(topology, values, drive, start, end)
    except NewContactPairs as met:
        return softest_point(topology.coupling(met.pairs), values, drive, start, end)


def _find_softest(
    topology: Topology, values: ConcreteParameters, drive: PrescribedMotion,
    start: tuple[float, Floats], end: float,
) -> SoftestPoint | None:  # fmt: skip
    path = ArcLengthPath(topology, values, drive)
    found: list[_LowestMode] = []
    for point in path.points(start, end, POINTS, turns=False):
        found.append(_lowest_mode(path, point))
        lowest = min(each.eigenvalue for each in found)
        if lowest < 0.0 and found[-1].eigenvalue > RECOVERY * lowest:
            break
    raise_new_pairs(path.system.contacts)
    softest = int(np.argmin([each.eigenvalue for each in found]))
    if softest in (0, len(found) - 1):
        return None
    before, after = found[softest - 1].point, found[softest + 1].point
    ahead = path.chord(before, found[softest].point)
    span = float(ahead @ path.step(before, after))
    near = path.tangent_at(before)

    def at(length: float) -> _LowestMode:
        point, _ = path.correct(before, ahead, length, near)
        return found[softest] if point is None else _lowest_mode(path, point)

    best = minimize_scalar(
        lambda length: at(length).eigenvalue, bounds=(0.0, span), method="bounded",
        options={"xatol": 0.1 * BRACKET * span},
    )  # fmt: skip
    left, middle, right = (at(best.x + side * BRACKET * span) for side in (-1.0, 0.0, 1.0))
    if middle.point.load >= end:
        return None
    falls, rises = (max(one.eigenvalue - middle.eigenvalue, 1e-300) for one in (left, right))
    share = rises / (falls + rises)
    one, two = (_slopes(path, topology, each, ahead) for each in (left, right))
    raise_new_pairs(path.system.contacts)
    slopes = ConcreteParameters(
        *(share * a + (1.0 - share) * b for a, b in zip(one, two, strict=True))
    )
    return SoftestPoint(middle.point.load, middle.eigenvalue, slopes)


def _lowest_mode(path: ArcLengthPath, point: PathPoint) -> _LowestMode:
    """Finds the smallest eigenvalue at a point, and its mode."""
    tangent = path.tangent_at(point)
    if tangent is None:
        values, modes = np.linalg.eigh(path.stiffness(point).toarray())
    else:
        values, modes = tangent.lowest(max(tangent.n_negative, 1))
    lowest = int(values.argmin())
    return _LowestMode(float(values[lowest]), modes[:, lowest], point)


def _slopes(
    path: ArcLengthPath, topology: Topology, soft: _LowestMode, ahead: Floats
) -> ConcreteParameters:
    """Differentiates an eigenvalue while the state changes across the way ``ahead`` alone."""
    system, state, free = path.system, soft.point.state, path.free
    mode = np.zeros_like(state)
    mode[free] = soft.mode / path.scale
    bars, bar = mode_slopes(topology, system, state, mode)
    held_direction = path.held_direction(soft.point)
    right = np.append(bar[free] / path.scale, bar @ held_direction)
    tangent = path.tangent_at(soft.point)
    if tangent is None:
        raise SimulationError("the tangent is singular at the softest point of a path")
    direction = np.zeros_like(state)
    direction[free] = -tangent.solve_transposed(right, ahead)[:-1] / path.scale
    kinematics = kinematics_of(system)
    locate(state, system, kinematics)
    mixed(state, system, kinematics, direction, topology.designed, bars.sensitivity)
    return as_values(bars, topology.n_units)
