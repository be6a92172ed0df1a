"""Method of moving asymptotes, globally convergent (Svanberg 1987; 2002, SIAM J. Optim. 12, 555).

The iterations are those of nlopt (LD_MMA, S. G. Johnson): each function is replaced by a separable
convex one with a pole on either side of every variable, stiffened where it proves too optimistic.
The constraints are cheap, so a trial that misses them is sent back without a simulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import nlopt
import numpy as np

from sim.core import Floats, SimulationError
from sim.optimise.feasibility import feasible_start, project
from sim.optimise.problem import ConstraintPoint, CountedProblem, EvaluatedPoint, Result

ROUNDING = 1e-4
"""Violation (mm) up to which a trial is moved back to the feasible set and simulated there."""

FAR = 1.0
"""Margin (mm) of a constraint that does not matter here."""

MOST_REFUSALS = 200
"""Trials in a row that miss the constraints, after which the descent has stalled."""


@dataclass(frozen=True)
class MmaOptions:
    """Settings; lengths in mm.

    Attributes:
        evaluations: largest number of simulations, corrections and failures included.
        target: loss that is good enough.
        span: range of a variable, in which a feasible start is sought.
        residual: KKT residual at which a design counts as optimal.
        step_min: largest change of a variable at which the method has converged.
    """

    evaluations: int = 60
    target: float = -np.inf
    span: float = 2.0
    residual: float = 1e-5
    step_min: float = 1e-6


class _EndedError(Exception):
    """Leaves nlopt from within a callback; the message is the reason."""


def mma(problem: CountedProblem, x0: Floats, options: MmaOptions) -> Result:
    """Minimises by moving asymptotes from the feasible design nearest to ``x0``."""
    place = feasible_start(problem, x0, options.span)
    point = problem.simulate(place)
    if isinstance(point, SimulationError):
        raise point
    run = _Run(problem, point, options)
    try:
        run.accept(place, point)
        _solver(problem, run, options).optimize(place.x)
        reason = "no further progress"
    except _EndedError as ended:
        reason = str(ended)
    except nlopt.RoundoffLimited:
        reason = "no further progress"
    return problem.result(reason)


def _solver(problem: CountedProblem, run: _Run, options: MmaOptions) -> nlopt.opt:
    solver = nlopt.opt(nlopt.LD_MMA, len(run.point.x))
    solver.set_min_objective(run.loss)
    if len(run.point.values):
        solver.add_inequality_mconstraint(run.violations, np.full(len(run.point.values), 1e-8))
    solver.set_lower_bounds(problem.lower)
    solver.set_upper_bounds(problem.upper)
    solver.set_xtol_abs(options.step_min)
    return solver


class _Run:
    """State of one run: the current design, and the trial that nlopt asks about.

    nlopt moves to each feasible design of a smaller loss, so its current design is the best one.
    """

    def __init__(self, problem: CountedProblem, point: EvaluatedPoint, options: MmaOptions) -> None:
        self.problem, self.options, self.point = problem, options, point
        self.place: ConstraintPoint = point
        self.residual = problem.stationarity(point).residual
        self.refusals = 0

    def loss(self, x: Floats, slope: Floats) -> float:
        """Returns the loss of a trial and writes its gradient (n,) to ``slope``.

        A trial that misses the constraints gets the tangent's value, which is below that of any
        replacement, so that only the constraints' replacements are stiffened; one that fails gets
        an infinite loss.
        """
        slope[:] = self.point.gradient
        if np.array_equal(x, self.point.x):
            return self.point.loss
        self.place = self.problem.place(x.copy())
        place = self._feasible()
        if place is None:
            return self.point.loss + float(self.point.gradient @ (x - self.point.x))
        outcome = self.problem.simulate(place)
        if isinstance(outcome, EvaluatedPoint) and outcome.loss < self.point.loss:
            self.accept(place, outcome)
        else:
            self._record(place, outcome, False)
        if isinstance(outcome, SimulationError):
            return float(np.inf)
        slope[:] = outcome.gradient
        return outcome.loss

    def violations(self, result: Floats, x: Floats, slopes: Floats) -> None:
        """Writes the constraints of a trial as f = -c <= 0 (m,) and their gradients (m, n).

        One that no variable changes here counts as far away: where it is active, its replacement,
        which grows with every variable, would leave no room to move.
        """
        if not np.array_equal(x, self.place.x):
            self.place = self.problem.place(x.copy())
        values, jacobian = self.place.values, self.place.jacobian
        still = abs(jacobian).sum(axis=1) == 0.0
        result[:] = -np.where(still & (values >= 0.0), np.maximum(values, FAR), values)
        if slopes.size:
            slopes[:] = -jacobian.toarray()

    def accept(self, place: ConstraintPoint, point: EvaluatedPoint) -> None:
        """Moves to a design.

        Raises:
            _EndedError: it is stationary, or no evaluation may follow.
        """
        self.residual = self.problem.stationarity(point).residual
        self._record(place, point, True)
        self.point = point
        if self.residual <= self.options.residual:
            raise _EndedError("stationary")

    def _feasible(self) -> ConstraintPoint | None:
        """Returns the trial, moved back if it misses the constraints by rounding alone."""
        near = self.place.violation <= ROUNDING
        place = project(self.problem, self.place.x, 10 * ROUNDING) if near else None
        self.refusals = self.refusals + 1 if place is None else 0
        if self.refusals > MOST_REFUSALS:
            raise _EndedError("no further progress")
        return place

    def _record(
        self, place: ConstraintPoint, outcome: EvaluatedPoint | SimulationError, accepted: bool
    ) -> None:
        length = float(np.abs(place.x - self.point.x).max(initial=0.0))
        self.problem.record(place, outcome, accepted, length, self.residual)
        if self.problem.finished:
            raise _EndedError(self.problem.finished)
