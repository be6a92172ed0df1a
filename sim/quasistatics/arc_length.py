"""Continues paths of equilibria by arc length, past the points where they turn back.

A path under a growing load ends where its tangent K becomes singular, and the structure snaps. The
path itself goes on: with the scaled free dofs x = S u and the way a of the held dofs as unknowns,

    g(x, a) = 0,    t . (x - x0, a - a0) = ds,

t being the path's tangent at the point before, is regular in a limit point too (Riks 1979, Int. J.
Solids Struct. 15, 529). Beyond it equilibria are unstable until the path turns forward again.
"""

from collections.abc import Iterator
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.optimize import brentq

from sim.core import Floats
from sim.energy import System, Topology, gradient, hessian_product, locate, system_of, workspace
from sim.solvers import PrescribedMotion, SelectedMotion
from sim.structure import ConcreteParameters
from sim.vibration import FullTangent

FIRST_LENGTH, LONGEST, SHORTEST = 0.05, 2.0, 1e-6
"""Arc length of a step, in mm of the root of the summed squares of all dofs."""
TRAPEZOIDAL_ERROR = 0.05
"""Departure of a step from the trapezoidal rule at most, over its length."""
CORRECTIONS, FAST = 12, 6
"""Newton steps of a point at most, and those up to which the next step is longer."""
CONVERGED = 1e-9
"""Newton step at which a point counts as found, mm."""
SLOW_RATE = 0.2
"""Share of the last Newton step above which the next is made by the tangent there."""
FEW = 20
"""Degrees of freedom below which all eigenvalues are computed."""
RECENT = 4
"""Loads at which the drive's rates are kept."""


class PathPoint(NamedTuple):
    """Holds one equilibrium of a path."""

    load: float  # load parameter
    state: Floats  # (n_dofs,)


class Tangent:
    """Holds the scaled tangent K (n_free, n_free) of a point, stable or not, and its factor.

    `load` (n_free,) is the force f of the held dofs' way.

    Raises:
        RuntimeError: K is singular.
    """

    def __init__(self, stiffness: sp.csc_array, load: Floats) -> None:
        self._stiffness, self.size, self._load = stiffness, len(load), load
        # without pivoting the signs of the pivots are those of the eigenvalues
        self._factor = spla.splu(
            stiffness, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        self.n_negative = int((self._factor.U.diagonal() < 0.0).sum())
        self._load_response = self._factor.solve(load)

    def solve(self, right: Floats, ahead: Floats) -> Floats:
        """Solves [K f; t] y = right (n_free + 1,), t the direction ahead."""
        # y = y1 - a K^-1 f with K y1 = r and t . y + t_a a = r_a
        free = self._factor.solve(right[:-1])
        load_step = (right[-1] - ahead[:-1] @ free) / (ahead[-1] - ahead[:-1] @ self._load_response)
        return np.append(free - load_step * self._load_response, load_step)

    def solve_transposed(self, right: Floats, ahead: Floats) -> Floats:
        """Solves [K t; f] y = right (n_free + 1,)."""
        free, along = self._factor.solve(right[:-1]), self._factor.solve(ahead[:-1])
        load_step = (right[-1] - self._load @ free) / (ahead[-1] - self._load @ along)
        return np.append(free - load_step * along, load_step)

    def lowest(self, count: int) -> tuple[Floats, Floats]:
        """Finds the smallest eigenvalue, or so many negative ones, from zero down; and modes."""
        if self.size < FEW:
            values, modes = np.linalg.eigh(self._stiffness.toarray())
            first = max(self.n_negative - count, 0)
            return values[first : first + count], modes[:, first : first + count]
        inverse = spla.LinearOperator(
            (self.size, self.size), matvec=self._factor.solve, dtype=float
        )
        start = np.sin(1.0 + np.arange(self.size))
        found, modes = spla.eigsh(inverse, count, which="SA" if self.n_negative else "LA", v0=start)
        return 1.0 / found, modes


def _rates(drive: SelectedMotion, weights: Floats, load: float) -> tuple[Floats, float]:
    """Computes the rates (n_held,) of the held dofs, and their weighted norm, mm."""
    rates = drive.rates(np.array([load]))[0]
    return rates, max(float(np.linalg.norm(rates * weights)), 1e-12)


class ArcLengthPath:
    """Evaluates balance and tangent of a structure along its drive."""

    def __init__(
        self, topology: Topology, values: ConcreteParameters, drive: PrescribedMotion
    ) -> None:
        self.system: System = system_of(topology, values)
        self._work = workspace(self.system)
        self._tangent = FullTangent(topology, values)
        self._n_moving = 3 * topology.n_units
        self._last: tuple[PathPoint, Tangent] | None = None
        self._held, self.free = topology.held, np.sort(topology.free_dofs)
        self._drive = drive.on(self._held)
        weights = topology.scale[self._held]
        self._rates = lru_cache(RECENT)(partial(_rates, self._drive, weights))
        self.scale = topology.scale[self.free]

    def points(
        self,
        start: tuple[float, Floats],
        end: float,
        most: int,
        longest: float = LONGEST,
        turns: bool = True,
    ) -> Iterator[PathPoint]:
        """Goes along the path forward from a stable equilibrium, ``most`` points at most.

        With ``turns``, the points at which it turns are among them. It ends where its load passes
        ``end`` or falls below that of rest, or where no step leads on.
        """
        point, length, number = self.point(*start), FIRST_LENGTH, 1
        ahead = self.direction(point, np.append(np.zeros(len(self.free)), 1.0))
        yield point
        while (
            ahead is not None and number < most and length > SHORTEST and 0.0 <= point.load <= end
        ):
            after, fast = self.correct(point, ahead, length)
            turned = None if after is None else self.direction(after, ahead)
            if (
                after is None
                or turned is None
                or self.trapezoidal_error(point, after, ahead + turned) > TRAPEZOIDAL_ERROR
            ):
                length *= 0.5
                continue
            if turns and ahead[-1] * turned[-1] < 0.0:
                yield self.turn(point, ahead, length)
            length = min(longest, 1.5 * length) if fast else length
            point, ahead, number = after, turned, number + 1
            yield point

    def point(self, load: float, state: Floats) -> PathPoint:
        """Places the held dofs of a state where the drive has them."""
        placed = np.array(state, dtype=float)
        placed[self._held] = self._drive.values(np.array([load]))[0]
        return PathPoint(load, placed)

    def correct(
        self, begin: PathPoint, ahead: Floats, length: float, near: Tangent | None = None
    ) -> tuple[PathPoint | None, bool]:
        """Finds the equilibrium an arc length ahead; tells whether it was found fast.

        The tangent ``near``, by default that at the beginning, serves as long as it leads on well.
        """
        load_scale, step, before = self._load_scale(begin.load), length * ahead, float(np.inf)
        tangent = near or self.tangent_at(begin)
        for number in range(CORRECTIONS):
            state = begin.state.copy()
            state[self.free] += step[:-1] / self.scale
            point = self.point(begin.load + step[-1] / load_scale, state)
            residual = np.append(self._force(point), ahead @ step - length)
            if tangent is None or not np.isfinite(residual).all():
                return None, False
            change = tangent.solve(-residual, ahead)
            if np.linalg.norm(change) > SLOW_RATE * before:
                tangent = self.tangent_at(point)
                if tangent is None:
                    return None, False
                change = tangent.solve(-residual, ahead)
            before = float(np.linalg.norm(change))
            if not before <= 2.0 * length:
                return None, False
            step += change
            if before < CONVERGED:
                return point, number < FAST
        return None, False

    def direction(self, point: PathPoint, before: Floats) -> Floats | None:
        """Returns the unit tangent (n_free + 1,) of the path, in the sense of the one before."""
        tangent = self.tangent_at(point)
        if tangent is None:
            return None
        found = tangent.solve(np.append(np.zeros(len(self.free)), 1.0), before)
        return found / np.linalg.norm(found)

    def step(self, begin: PathPoint, after: PathPoint) -> Floats:
        """Computes the scaled step (n_free + 1,) between two points, mm."""
        moved = (after.state - begin.state)[self.free] * self.scale
        return np.append(moved, (after.load - begin.load) * self._load_scale(begin.load))

    def trapezoidal_error(self, begin: PathPoint, after: PathPoint, mean: Floats) -> float:
        """Measures the departure of a step from the trapezoidal rule, over its length.

        `mean` (n_free + 1,) is twice the mean of the tangents at its ends.
        """
        step = self.step(begin, after)
        # x1 - x0 = ds (t0 + t1) / 2
        along = mean / np.linalg.norm(mean)
        return float(np.linalg.norm(step - (along @ step) * along) / np.linalg.norm(step))

    def turn(self, begin: PathPoint, ahead: Floats, length: float) -> PathPoint:
        """Finds the point within an arc length at which the load does not change."""

        def forward(share: float) -> float:
            point = self.correct(begin, ahead, share * length)[0] if share else begin
            turned = None if point is None else self.direction(point, ahead)
            return -float(ahead[-1]) if turned is None else float(turned[-1])

        share = brentq(forward, 0.0, 1.0, xtol=1e-9, disp=False)
        return self.correct(begin, ahead, share * length)[0] or begin

    def chord(self, begin: PathPoint, after: PathPoint) -> Floats:
        """Returns the direction (n_free + 1,) from one point to another."""
        step = self.step(begin, after)
        return step / np.linalg.norm(step)

    def stability(self, point: PathPoint) -> tuple[float, int]:
        """Returns the smallest eigenvalue, or the last negative one, and how many are negative."""
        tangent = self.tangent_at(point)
        if tangent is None:
            return 0.0, 0
        return float(tangent.lowest(1)[0][0]), tangent.n_negative

    def tangent_at(self, point: PathPoint) -> Tangent | None:
        """Factorises the tangent at a point; None if it is singular."""
        if self._last is None or self._last[0] is not point:
            held_direction, along = self.held_direction(point), np.empty_like(point.state)
            locate(point.state, self.system, self._work.kinematics)
            hessian_product(point.state, self.system, self._work.kinematics, held_direction, along)
            try:
                found = Tangent(self.stiffness(point), along[self.free] / self.scale)
            except RuntimeError:
                return None
            self._last = point, found
        return self._last[1]

    def held_direction(self, point: PathPoint) -> Floats:
        """Computes the unit direction (n_dofs,) in which the drive moves the held dofs."""
        found = np.zeros_like(point.state)
        found[self._held], load_scale = self._rates(point.load)
        return found / load_scale

    def _load_scale(self, load: float) -> float:
        """Computes the speed of the held dofs by the load parameter, mm."""
        return self._rates(load)[1]

    def _force(self, point: PathPoint) -> Floats:
        gradient(point.state, self.system, self._work.kinematics, self._work.force)
        return np.asarray(self._work.force[self.free] / self.scale)

    def stiffness(self, point: PathPoint) -> sp.csc_array:
        """Assembles the scaled tangent (n_free, n_free)."""
        found = self._tangent.submatrix(self.free, self.free, point.state[: self._n_moving])
        weights = 1.0 / self.scale
        found.data *= weights[found.indices] * np.repeat(weights, np.diff(found.indptr))
        return found
