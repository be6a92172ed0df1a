"""Solves the subproblem of the method of moving asymptotes by a primal-dual interior point.

    minimise    g_0(x) + weight * sum(y)
    subject to  g_i(x) <= y_i,  y >= 0,  low <= x <= high
    with        g_i(x) = at_centre_i + sum_j up_ij r(U_j - x_j) + down_ij r(x_j - L_j),
                r(gap) = 1/gap - 1/d_j,  U = centre + d,  L = centre - d.

The elastic variables y make it solvable whatever the constraints are. The Newton systems (Svanberg
2007, "MMA and GCMMA", section 5) are reduced to the variables or to the constraints, whichever are
fewer.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cho_factor, cho_solve

from sim.core import Floats, Ints

GROWTH = 10.0
"""Growth of the residual that a Newton step may cause; insisting on descent makes steps tiny."""

WEIGHT = 1000.0
"""Price of violating a constraint, relative to the steepest slope of the objective."""


class UnsolvedError(ArithmeticError):
    """Reports that the interior point of a subproblem does not converge."""


@dataclass(frozen=True)
class Separable:
    """Describes the functions of the subproblem; row 0 is the objective."""

    centre: Floats  # (n,) expansion point
    distance: Floats  # (n,) to the poles
    low: Floats  # (n,) lower bounds
    high: Floats  # (n,) upper bounds
    up: sp.csr_array  # (1 + m, n) coefficients, >= 0
    down: sp.csr_array  # likewise, with entries at the same places
    at_centre: Floats  # (1 + m,) values at the centre

    def values(self, x: Floats) -> Floats:
        """Evaluates all functions (1 + m,)."""
        above, below = self._gaps(x)
        rise, fall = 1 / above - 1 / self.distance, 1 / below - 1 / self.distance
        return self.at_centre + self.up @ rise + self.down @ fall

    def slopes(self, x: Floats) -> sp.csr_array:
        """Computes their derivatives (1 + m, n)."""
        return _with_entries(self.up, self.entries(x))

    def entries(self, x: Floats) -> Floats:
        """Computes those derivatives at the places of the coefficients (n_entries,) alone."""
        above, below = self._gaps(x)
        columns = self.up.indices
        return self.up.data * (above**-2)[columns] - self.down.data * (below**-2)[columns]

    def summed(self, entries: Floats, multipliers: Floats) -> Floats:
        """Sums (n,) such entries over the functions, weighted with ``multipliers`` (1 + m,)."""
        weighted = entries * multipliers[self._rows]
        total = np.bincount(self.up.indices, weighted, minlength=len(self.centre))
        return np.asarray(total, dtype=float)

    def curvature(self, x: Floats, multipliers: Floats) -> Floats:
        """Computes the diagonal (n,) of the Hessian, summed by ``multipliers`` (1 + m,)."""
        above, below = self._gaps(x)
        rise = self.summed(self.up.data, multipliers) * above**-3
        return 2 * (rise + self.summed(self.down.data, multipliers) * below**-3)

    @cached_property
    def _rows(self) -> Ints:
        return np.repeat(np.arange(self.up.shape[0]), np.diff(self.up.indptr))

    def _gaps(self, x: Floats) -> tuple[Floats, Floats]:
        return self.centre + self.distance - x, x - self.centre + self.distance


def _with_entries(pattern: sp.csr_array, entries: Floats) -> sp.csr_array:
    # no arithmetic of SciPy's: a tenth of a millisecond each, for the widths of its indices
    return sp.csr_array((entries, pattern.indices, pattern.indptr), shape=pattern.shape)


@dataclass(frozen=True)
class _State:
    """Unknowns of the interior point; all but x are positive."""

    x: Floats  # (n,) variables
    y: Floats  # (m,) elastic variables of the constraints
    slack: Floats  # (m,) their slacks
    multiplier: Floats  # (m,) multipliers of the constraints
    y_multiplier: Floats  # (m,) multipliers of y >= 0
    low_multiplier: Floats  # (n,) multipliers of the lower bounds
    high_multiplier: Floats  # (n,) of the upper bounds

    def moved(self, step: _State, length: float) -> _State:
        return _State(
            *(getattr(self, f.name) + length * getattr(step, f.name) for f in fields(self))
        )


def minimise_separable(problem: Separable, tolerance: float = 1e-8) -> tuple[Floats, Floats]:
    """Solves the subproblem; returns x (n,) and the multipliers (m,) of the constraints.

    Raises:
        UnsolvedError: no convergence: numbers of wildly different scales, or too small a tolerance.
    """
    scale = float(np.abs(problem.slopes(problem.centre)[[0]].data).max(initial=0.0)) or 1.0
    solver = _InteriorPoint(_scaled(problem, scale))
    state = solver.start()
    barrier = 1.0
    for _ in range(300):
        residual = solver.residual(state, barrier)
        if np.abs(residual).max() < 0.9 * barrier:
            if barrier <= tolerance:
                return state.x, state.multiplier * scale
            barrier /= 10
        state = solver.advance(state, barrier)
    raise UnsolvedError("the subproblem of moving asymptotes did not converge")


def _scaled(problem: Separable, scale: float) -> Separable:
    """Divides the objective by ``scale``."""

    def divided(coefficients: sp.csr_array) -> sp.csr_array:
        entries = coefficients.data.copy()
        entries[: coefficients.indptr[1]] /= scale
        return _with_entries(coefficients, entries)

    at_centre = problem.at_centre.copy()
    at_centre[0] /= scale
    up, down = divided(problem.up), divided(problem.down)
    return replace(problem, up=up, down=down, at_centre=at_centre)


class _InteriorPoint:
    def __init__(self, problem: Separable) -> None:
        self.problem = problem
        self.count = len(problem.at_centre) - 1

    def start(self) -> _State:
        low, high = self.problem.low, self.problem.high
        x = np.clip(self.problem.centre, 0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high)
        ones = np.ones(self.count)
        return _State(
            x, ones, ones, ones, ones * WEIGHT / 2,
            np.maximum(1.0, 1 / (x - low)), np.maximum(1.0, 1 / (high - x)),
        )  # fmt: skip

    def residual(self, state: _State, barrier: float) -> Floats:
        """Evaluates the optimality conditions, with complementarity relaxed to ``barrier``."""
        problem, weights = self.problem, np.concatenate([[1.0], state.multiplier])
        return np.concatenate(
            [
                problem.summed(problem.entries(state.x), weights)
                - state.low_multiplier
                + state.high_multiplier,
                WEIGHT - state.multiplier - state.y_multiplier,
                problem.values(state.x)[1:] - state.y + state.slack,
                state.low_multiplier * (state.x - problem.low) - barrier,
                state.high_multiplier * (problem.high - state.x) - barrier,
                state.y_multiplier * state.y - barrier,
                state.multiplier * state.slack - barrier,
            ]
        )

    def advance(self, state: _State, barrier: float) -> _State:
        """Takes one damped Newton step towards the central path."""
        step = self._newton(state, barrier)
        length = self._longest_step(state, step)
        before = np.linalg.norm(self.residual(state, barrier))
        for _ in range(50):
            trial = state.moved(step, length)
            if np.linalg.norm(self.residual(trial, barrier)) < GROWTH * before:
                break
            length /= 2
        return trial

    def _newton(self, state: _State, barrier: float) -> _State:
        problem = self.problem
        below, above = state.x - problem.low, problem.high - state.x
        weights = np.concatenate([[1.0], state.multiplier])
        slopes = problem.slopes(state.x)
        diagonal = (
            problem.curvature(state.x, weights)
            + state.low_multiplier / below
            + state.high_multiplier / above
        )
        compliance = state.slack / state.multiplier + state.y / state.y_multiplier
        right_x = -(problem.summed(slopes.data, weights) - barrier / below + barrier / above)
        right_p = -(
            problem.values(state.x)[1:]
            - state.y
            + barrier / state.multiplier
            + state.y * (WEIGHT - state.multiplier) / state.y_multiplier
            - barrier / state.y_multiplier
        )
        dx, multiplier = _saddle(diagonal, slopes[1:], compliance, right_x, right_p)
        y_multiplier = WEIGHT - state.multiplier - multiplier - state.y_multiplier
        return _State(
            x=dx,
            y=barrier / state.y_multiplier - state.y - state.y * y_multiplier / state.y_multiplier,
            slack=barrier / state.multiplier
            - state.slack
            - state.slack * multiplier / state.multiplier,
            multiplier=multiplier,
            y_multiplier=y_multiplier,
            low_multiplier=barrier / below
            - state.low_multiplier
            - state.low_multiplier * dx / below,
            high_multiplier=barrier / above
            - state.high_multiplier
            + state.high_multiplier * dx / above,
        )

    def _longest_step(self, state: _State, step: _State) -> float:
        """Finds the longest step, at most 1, that keeps everything positive by a margin."""
        pairs = [
            (getattr(state, name), getattr(step, name))
            for name in (
                "y",
                "slack",
                "multiplier",
                "y_multiplier",
                "low_multiplier",
                "high_multiplier",
            )
        ]
        pairs += [(state.x - self.problem.low, step.x), (self.problem.high - state.x, -step.x)]
        ratio = max(float(np.max(-change / value, initial=0.0)) for value, change in pairs)
        return 1.0 / max(1.0, 1.01 * ratio)


def _saddle(
    diagonal: Floats, matrix: sp.csr_array, compliance: Floats, right_x: Floats, right_p: Floats
) -> tuple[Floats, Floats]:
    """Solves diagonal dx + matrix^T dp = right_x and matrix dx - compliance dp = right_p."""
    if matrix.shape[0] < matrix.shape[1]:
        scaled = _with_entries(matrix, matrix.data * (1 / diagonal)[matrix.indices])
        schur = (scaled @ matrix.T).toarray() + np.diag(compliance)
        dp = cho_solve(cho_factor(schur), scaled @ right_x - right_p)
        return (right_x - matrix.T @ dp) / diagonal, dp
    each = np.repeat(1 / compliance, np.diff(matrix.indptr))
    scaled = _with_entries(matrix, matrix.data * each)
    schur = (matrix.T @ scaled).toarray() + np.diag(diagonal)
    dx = cho_solve(cho_factor(schur), right_x + scaled.T @ right_p)
    return dx, (matrix @ dx - right_p) / compliance
