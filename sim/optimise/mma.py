"""Minimises by moving asymptotes (Svanberg 1987; globally: 2002, SIAM J. Optim. 12, 555).

Each function is replaced by a separable convex one with a pole on either side of every variable.
If a replacement proves too optimistic at the optimum, it is stiffened and solved again. The
constraints are cheap, so for them this happens before the loss is simulated.
"""

# nlopt's LD_MMA does not take its place: without bounds on the variables its first three designs
# of fig2@quick end at a loss of 0.353 in place of 0.247. Within +-3 mm it is as good: 60 designs
# of figure 2 end at 0.5835 in place of 0.5856, with half the time outside the simulation; since
# then subproblems of up to 120 variables have become three times as fast.

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from sim.core import Floats, Ints, SimulationError
from sim.optimise.feasibility import feasible_start, project
from sim.optimise.mma_subproblem import Separable, UnsolvedError, minimise_separable
from sim.optimise.problem import ConstraintPoint, CountedProblem, EvaluatedPoint, Result
from sim.optimise.qp import reachable

SLOWER, FASTER = 0.7, 1.2
"""Factors of the distance to the poles after a variable has turned, or gone on."""

NEAREST, FARTHEST = 0.01, 1.5
"""Limits of that distance, relative to the range of the variable."""

MOVE = 0.9
"""Largest move of a variable, relative to the distance of its poles."""

SOFTEN, STIFFEN = 0.1, 10.0
"""Factor of the stiffness from one design to the next; its largest growth in one correction."""

LEAST_REDUCTION = 0.1
"""Share of the expected decrease with which a step is kept although the loss was underestimated."""

CORRECTIONS = 3
"""Largest number of corrections of the constraints before one simulation."""


@dataclass(frozen=True)
class MmaOptions:
    """Holds the options of moving asymptotes; lengths in mm.

    Attributes:
        evaluations: largest number of simulations, corrections and failures included.
        target: loss that is good enough.
        span: range of a variable without finite bounds.
        asymptote: first distance of the poles, relative to the range.
        residual: KKT residual at which a design counts as optimal.
        step_min: largest change of a variable at which the method has converged.
    """

    evaluations: int = 60
    target: float = -np.inf
    span: float = 2.0
    asymptote: float = 0.5
    residual: float = 1e-5
    step_min: float = 1e-6


class Approximation:
    """Replaces the loss (row 0) and the constraints by convex separable ones around one design.

    Svanberg's constraints read f <= 0, so f = -c. A constraint is stiffened only in the variables
    that it depends on, which keeps it sparse.
    """

    def __init__(self, point: EvaluatedPoint, distance: Floats, stiffness: Floats) -> None:
        self.point = point
        self.distance = distance
        self.stiffness = stiffness  # (1 + m,) weight of the added convex term of each function
        self.slopes = sp.csr_array(sp.vstack([point.gradient[None], -point.jacobian]))
        self.slopes.eliminate_zeros()

    def separable(self, rows: Ints, lower: Floats, upper: Floats) -> Separable:
        """Builds the subproblem with the functions ``rows`` (the loss first)."""
        chosen = self.slopes[rows].tocoo()
        row, column = chosen.coords
        reach = self.distance[column]
        extra = self.stiffness[rows][row] * reach / 4
        up = reach**2 * np.maximum(chosen.data, 0) + extra
        down = reach**2 * np.maximum(-chosen.data, 0) + extra
        x = self.point.x
        return Separable(
            centre=x,
            distance=self.distance,
            low=np.maximum(lower, x - MOVE * self.distance),
            high=np.minimum(upper, x + MOVE * self.distance),
            up=sp.csr_array((up, (row, column)), chosen.shape),
            down=sp.csr_array((down, (row, column)), chosen.shape),
            at_centre=np.concatenate([[self.point.loss], -self.point.values])[rows],
        )

    def correct(self, rows: Ints, x: Floats, shortfall: Floats) -> None:
        """Stiffens the functions that the replacements underestimated by ``shortfall`` at ``x``."""
        square = (x - self.point.x) ** 2
        pattern = self.slopes[rows]
        pattern.data = np.ones_like(pattern.data)
        growth = np.maximum(pattern @ (square / (self.distance**2 - square)) / 2, 1e-300)
        old = self.stiffness[rows]
        new = np.minimum(1.1 * (old + np.maximum(shortfall, 0) / growth), STIFFEN * old)
        self.stiffness[rows] = np.where(shortfall > 0, new, old)


@dataclass(frozen=True)
class MmaTrial:
    """Holds a feasible design that the replacements propose, and the loss predicted there."""

    place: ConstraintPoint
    predicted: float


def mma(problem: CountedProblem, x0: Floats, options: MmaOptions) -> Result:
    """Runs the outer iterations: replace, solve and correct, move, adapt the poles."""
    place = feasible_start(problem, x0, options.span)
    point = problem.simulate(place)
    if isinstance(point, SimulationError):
        raise point
    run = _Run(problem, point, options)
    problem.record(place, point, True, float(run.distance.max(initial=0.0)), run.residual)
    while problem.finished is None and run.reason is None:
        run.outer()
    return problem.result(problem.finished or run.reason or "")


class _Run:
    """Holds the state of one run: the current design, its poles and stiffnesses."""

    def __init__(self, problem: CountedProblem, point: EvaluatedPoint, options: MmaOptions) -> None:
        self.problem, self.options, self.point = problem, options, point
        width = problem.upper - problem.lower
        if not (width > 0.0).all():
            raise ValueError("MMA needs room between the bounds of every variable: leave it out")
        self.width = np.where(np.isfinite(width), width, options.span)
        self.distance = options.asymptote * self.width
        self.stiffness = np.ones(1 + len(point.values))
        self._set_stiffness()
        self.last = np.zeros_like(point.x)
        self.residual = problem.stationarity(point).residual
        self.reason = "stationary" if self.residual <= options.residual else None

    def _set_stiffness(self) -> None:
        """Starts with a tenth of each function's mean slope across the poles."""
        slopes = abs(sp.csr_array(sp.vstack([self.point.gradient[None], self.point.jacobian])))
        entries = np.maximum(np.diff(slopes.indptr), 1)
        least = np.full(len(entries), 1e-6)
        least[0] *= self.problem.unit
        self.stiffness = np.maximum(0.1 * (slopes @ self.distance) / entries, least)
        self.least = 1e-2 * self.stiffness

    def outer(self) -> None:
        """Makes one accepted move, with as many corrections as it takes."""
        model = Approximation(self.point, self.distance, self.stiffness)
        rejected, stuck = np.zeros(0), False
        while self.problem.finished is None and self.reason is None:
            trial = self._next(model)
            if trial is None:
                continue
            stuck = stuck or np.array_equal(trial.place.x, rejected)
            if stuck and trial.predicted >= self.point.loss:
                self._tighten_asymptotes()
                continue
            outcome = self.problem.simulate(trial.place)
            if isinstance(outcome, EvaluatedPoint) and self._is_acceptable(trial, outcome):
                self._move(trial, outcome)
                return
            self.problem.record(
                trial.place, outcome, False, float(self.distance.max()), self.residual
            )
            rejected = trial.place.x
            if isinstance(outcome, EvaluatedPoint):
                shortfall = np.array([outcome.loss - trial.predicted])
                model.correct(np.zeros(1, dtype=int), outcome.x, shortfall)
            else:
                self.distance *= SLOWER**2

    def _next(self, model: Approximation) -> MmaTrial | None:
        """Proposes a design; None if the poles have come closer in place of it, or at the end."""
        try:
            trial = self._propose(model)
        except UnsolvedError as error:
            self.reason = str(error)
            return None
        except SimulationError:  # of the constraints: they know of no design so far away
            self._tighten_asymptotes()
            return None
        if trial is None or self._length(trial.place) < self.options.step_min:
            self.reason = "no further progress"
            return None
        return trial

    def _tighten_asymptotes(self) -> None:
        """Tightens the asymptotes; ends the run if that leaves no room for a step."""
        self.distance *= SLOWER**2
        if self.distance.max() < self.options.step_min:
            self.reason = "no further progress"

    def _length(self, place: ConstraintPoint) -> float:
        return float(np.abs(place.x - self.point.x).max())

    def _is_acceptable(self, trial: MmaTrial, outcome: EvaluatedPoint) -> bool:
        expected = self.point.loss - trial.predicted
        return self.point.loss - outcome.loss >= LEAST_REDUCTION * expected > 0

    def _move(self, trial: MmaTrial, outcome: EvaluatedPoint) -> None:
        used = float(self.distance.max())
        step = outcome.x - self.point.x
        turned = step * self.last
        self.distance *= np.where(turned > 0, FASTER, np.where(turned < 0, SLOWER, 1.0))
        self.distance = np.clip(self.distance, NEAREST * self.width, FARTHEST * self.width)
        self.stiffness = np.maximum(SOFTEN * self.stiffness, self.least)
        self.point, self.last = outcome, step
        self.residual = self.problem.stationarity(outcome).residual
        if self.residual <= self.options.residual:
            self.reason = "stationary"
        self.problem.record(trial.place, outcome, True, used, self.residual)

    def _propose(self, model: Approximation) -> MmaTrial | None:
        """Solves the replacements until those of the constraints are on the safe side."""
        problem, reach = self.problem, MOVE * float(self.distance.max())
        rows = 1 + reachable(self.point.values, self.point.jacobian, reach)
        rows = np.concatenate([[0], rows])
        for _ in range(CORRECTIONS):
            subproblem = model.separable(rows, problem.lower, problem.upper)
            x, _ = minimise_separable(subproblem)
            place = problem.place(x)
            if place.violation <= 1e-9:
                break
            shortfall = -place.values[rows[1:] - 1] - subproblem.values(x)[1:]
            model.correct(rows[1:], x, np.where(place.values[rows[1:] - 1] < 0, shortfall, 0.0))
        feasible = project(problem, place.x, reach)
        if feasible is None:
            return None
        return MmaTrial(feasible, float(subproblem.values(feasible.x)[0]))
