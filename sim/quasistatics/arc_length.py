"""Traces paths of equilibria by arc length, past the points where they turn back.

A path under a growing load ends where its tangent K becomes singular, and the structure snaps. The
path itself goes on: with the scaled free dofs x = S u and the way a of the held dofs as unknowns,

    g(x, a) = 0,    t . (x - x0, a - a0) = ds,

t being the path's tangent at the point before, is regular in a limit point too (Riks 1979, Int. J.
Solids Struct. 15, 529). Beyond it equilibria are unstable until the path turns forward again.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.optimize import brentq

from sim.collision import raise_new_pairs
from sim.core import Floats, Ints, NewContactPairs
from sim.energy import System, Topology, gradient, hessian_product, locate, system_of, workspace
from sim.quasistatics.equilibrium_path import BRANCHING
from sim.quasistatics.static_solver import StaticRecord, StaticSolver
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters
from sim.vibration import WholeTangent

FIRST_LENGTH, LONGEST, SHORTEST = 0.05, 2.0, 1e-6
"""Arc length of a step, in mm of the root of the summed squares of all dofs."""
CROOKED = 0.05
"""Departure of a step from the trapezoidal rule at most, over its length."""
CORRECTIONS, FAST = 8, 4
"""Newton steps of a point at most, and those up to which the next step is longer."""
BALANCED = 1e-9
"""Newton step at which a point counts as found, mm."""
PAST = 1e-6
"""Share of its load by which a path may pass the snap that it turns at."""
FEW = 20
"""Degrees of freedom below which all eigenvalues are computed."""


class EquilibriumTrace(NamedTuple):
    """Holds points of a path, in the order in which it passes them."""

    loads: Floats  # (n_points,) load parameters
    states: Floats  # (n_points, n_dofs) equilibria, stable or not
    # (n_points,) smallest one of the tangent, with rotations times the scale, N/mm; of several
    # negative ones that nearest to zero
    eigenvalue: Floats
    falling: Ints  # (n_points,) number of negative eigenvalues

    @property
    def turns(self) -> Ints:
        """(n_turns,) numbers of the points at which the path turns back or forward again."""
        return np.asarray(1 + np.flatnonzero(np.diff(np.sign(np.diff(self.loads)))))


def trace(
    topology: Topology,
    values: ConcreteParameters,
    drive: PrescribedMotion,
    start: tuple[float, Floats],
    end: float,
    points: int = 200,
    longest: float = LONGEST,
) -> EquilibriumTrace:
    """Traces the path of equilibria through a stable one, from load parameter and state (n_dofs,).

    It goes forward from there, and ends where its load passes ``end``, falls below that of rest, or
    after so many ``points``; earlier where no step leads on, as in jammed contact. `longest` is the
    arc length of a step at most, mm.
    """
    try:
        return _trace(topology, values, drive, start, end, points, longest)
    except NewContactPairs as met:
        return trace(topology.coupling(met.pairs), values, drive, start, end, points, longest)


def trace_first_snap(
    solver: StaticSolver, values: ConcreteParameters, drive: PrescribedMotion, record: StaticRecord
) -> EquilibriumTrace | None:
    """Traces the path that the first snap of a solution leaves, from the last load before it.

    It ends where it comes by that snap's load again, or by that of the last one before the next
    load; where it branches, at the full load.

    Returns:
        the path; None without a snap, or with one at rest.
    """
    if not len(record.snaps) or record.snaps[0] <= 0.0:
        return None
    loads, top = solver.output_times, record.topology or solver.topology
    number = int(np.searchsorted(loads, record.snaps[0]))
    rest = 0.0, np.zeros(top.n_dofs)
    before = (float(loads[number - 1]), record.states[number - 1]) if number else rest
    limit_point = record.jumped[number] != BRANCHING
    near = record.snaps[record.snaps <= loads[number]]
    end = float(near[-1] * (1.0 + PAST) if limit_point else loads[-1])
    found = trace(top, values, drive, before, end)
    kept = found.loads <= end
    return EquilibriumTrace(
        found.loads[kept], found.states[kept], found.eigenvalue[kept], found.falling[kept]
    )


def _trace(
    topology: Topology, values: ConcreteParameters, drive: PrescribedMotion,
    start: tuple[float, Floats], end: float, points: int, longest: float,
) -> EquilibriumTrace:  # fmt: skip
    path = _Path(topology, values, drive)
    point = path.point(*start)
    ahead = path.tangent(point, np.append(np.zeros(topology.n_free), 1.0))
    found, length = [point], FIRST_LENGTH
    while (
        ahead is not None and len(found) < points and length > SHORTEST and 0.0 <= point.load <= end
    ):
        after, fast = path.correct(point, ahead, length)
        turned = None if after is None else path.tangent(after, ahead)
        if after is None or turned is None or path.crooked(point, after, ahead + turned) > CROOKED:
            length *= 0.5
            continue
        if ahead[-1] * turned[-1] < 0.0:
            found.append(path.turn(point, ahead, length))
        length = min(longest, 1.5 * length) if fast else length
        point, ahead = after, turned
        found.append(point)
    eigenvalue, falling = zip(*map(path.stability, found), strict=True)
    raise_new_pairs(path.system.contacts)
    return EquilibriumTrace(
        np.array([one.load for one in found]),
        np.stack([one.state for one in found]),
        np.array(eigenvalue),
        np.array(falling),
    )


class _Point(NamedTuple):
    load: float
    state: Floats


class _Path:
    """Evaluates balance and tangent of a structure along its drive."""

    def __init__(
        self, topology: Topology, values: ConcreteParameters, drive: PrescribedMotion
    ) -> None:
        self.system: System = system_of(topology, values)
        self._drive, self._work = drive, workspace(self.system)
        self._tangent, self._scale = WholeTangent(topology, values), topology.scale
        self._n_moving = 3 * topology.n_units
        self._held, self._free = topology.held, np.sort(topology.free_dofs)

    def point(self, load: float, state: Floats) -> _Point:
        """Places the held dofs of a state where the drive has them."""
        placed = np.array(state, dtype=float)
        placed[self._held] = self._drive.values(self._held, np.array([load]))[0]
        return _Point(load, placed)

    def correct(self, begin: _Point, ahead: Floats, length: float) -> tuple[_Point | None, bool]:
        """Finds the equilibrium an arc length ahead; tells whether it was found fast."""
        pace = self._pace(begin.load)
        step = length * ahead
        for number in range(CORRECTIONS):
            state = begin.state.copy()
            state[self._free] += step[:-1] / self._scale[self._free]
            point = self.point(begin.load + step[-1] / pace, state)
            residual = np.append(self._force(point), ahead @ step - length)
            if not np.isfinite(residual).all():
                return None, False
            change = self._solved(point, ahead, -residual, pace)
            if change is None or np.linalg.norm(change) > 2.0 * length:
                return None, False
            step += change
            if np.linalg.norm(change) < BALANCED:
                return point, number < FAST
        return None, False

    def tangent(self, point: _Point, before: Floats) -> Floats | None:
        """Returns the unit tangent (n_free + 1,) of the path, in the sense of the one before."""
        right = np.append(np.zeros(len(self._free)), 1.0)
        found = self._solved(point, before, right, self._pace(point.load))
        return None if found is None else found / np.linalg.norm(found)

    def crooked(self, begin: _Point, after: _Point, mean: Floats) -> float:
        """Compares a step with the trapezoidal rule along twice the mean of its ends' tangents."""
        moved = (after.state - begin.state)[self._free] * self._scale[self._free]
        step = np.append(moved, (after.load - begin.load) * self._pace(begin.load))
        # x1 - x0 = ds (t0 + t1) / 2
        along = mean / np.linalg.norm(mean)
        return float(np.linalg.norm(step - (along @ step) * along) / np.linalg.norm(step))

    def turn(self, begin: _Point, ahead: Floats, length: float) -> _Point:
        """Finds the point within an arc length at which the load does not change."""

        def forward(share: float) -> float:
            point = self.correct(begin, ahead, share * length)[0] if share else begin
            turned = None if point is None else self.tangent(point, ahead)
            return -float(ahead[-1]) if turned is None else float(turned[-1])

        share = brentq(forward, 0.0, 1.0, xtol=1e-9, disp=False)
        return self.correct(begin, ahead, share * length)[0] or begin

    def stability(self, point: _Point) -> tuple[float, int]:
        """Returns the smallest eigenvalue, or the last negative one, and how many are negative."""
        stiffness = self._stiffness(point)
        factor = spla.splu(
            stiffness, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        size, falling = len(self._free), int((factor.U.diagonal() < 0.0).sum())
        if size < FEW:
            return float(np.linalg.eigvalsh(stiffness.toarray())[0]), falling
        inverse = spla.LinearOperator((size, size), matvec=factor.solve, dtype=float)
        of_inverse = spla.eigsh(
            inverse, 1, which="SA" if falling else "LA", v0=np.sin(1.0 + np.arange(size)),
            return_eigenvectors=False,
        )  # fmt: skip
        return float(1.0 / of_inverse[0]), falling

    def _pace(self, load: float) -> float:
        """Returns the way of the held dofs over the load parameter, mm."""
        rates = self._drive.rates(self._held, np.array([load]))[0]
        return max(float(np.linalg.norm(rates * self._scale[self._held])), 1e-12)

    def _force(self, point: _Point) -> Floats:
        gradient(point.state, self.system, self._work.kinematics, self._work.force)
        return np.asarray(self._work.force[self._free] / self._scale[self._free])

    def _stiffness(self, point: _Point) -> sp.csc_array:
        weights = sp.diags_array(1.0 / self._scale[self._free])
        motion = point.state[: self._n_moving]
        stiffness = self._tangent.among(self._free, self._free, motion)
        return sp.csc_array(weights @ stiffness @ weights)

    def _solved(self, point: _Point, ahead: Floats, right: Floats, pace: float) -> Floats | None:
        """Solves [K f; t] y = right with f the force of the held dofs' way; None if singular."""
        way = np.zeros_like(point.state)
        way[self._held] = self._drive.rates(self._held, np.array([point.load]))[0] / pace
        along = np.empty_like(way)
        locate(point.state, self.system, self._work.kinematics)
        hessian_product(point.state, self.system, self._work.kinematics, way, along)
        column = sp.csc_array((along[self._free] / self._scale[self._free])[:, None])
        whole = sp.block_array(
            [[self._stiffness(point), column], [ahead[None, :-1], ahead[None, -1:]]], format="csc"
        )
        try:
            return np.asarray(spla.splu(whole).solve(right))
        except RuntimeError:
            return None
