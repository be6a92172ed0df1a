"""Minimises by trust-region SQP, in which every simulated design is feasible.

The constraints are cheap and the loss is not: so each trial step is brought back to the feasible
set before it is simulated, and the loss alone decides whether it is accepted (Wright and Tenny
2004, SIAM J. Optim. 14, 1074, with a quasi-Newton model of the Lagrangian).
"""

from dataclasses import dataclass, replace

import numpy as np

from sim.core import Floats, Ints, SimulationError
from sim.optimise.feasibility import feasible_start, interior_design, project
from sim.optimise.problem import ConstraintPoint, CountedProblem, EvaluatedPoint, Result
from sim.optimise.qp import dense_step, reachable
from sim.optimise.quasi_newton import QuasiNewton

ACCEPT, SHRINK, GROW = 1e-4, 0.25, 0.75
"""Ratios of actual to predicted reduction: to accept a step, to shrink and to grow the radius."""

RESTART_COST = 3
"""A restart is made if it can take this many times the patience."""

CAUTION_DECAY = 0.9
"""Factor of the caution from one evaluation to the next."""

UNEXPLAINED_SHARE = 0.5
"""Share of a change of the loss that the slopes at both ends may leave unexplained."""


@dataclass(frozen=True)
class SqpOptions:
    """Holds the options of trust-region SQP; lengths in mm.

    Attributes:
        evaluations: largest number of simulations, failed ones included.
        target: loss that is good enough.
        radius: largest change of a variable in the first step.
        radius_max: the same in any step.
        caution: share of every margin that the first step leaves; later ones leave less and less.
        radius_min: radius at which the descent has stalled.
        residual: KKT residual at which a design counts as optimal.
        patience: the descent has stalled if this many simulations in a row ...
        progress: ... have together reduced the loss by less than this fraction.
        retreats: how many times to start again from inside the feasible set ...
        depth: ... where every margin is this large, if there is such a place ...
        kick: ... near the best design with random shifts of at most this size.
        seed: of the shifts.
    """

    evaluations: int = 120
    target: float = -np.inf
    radius: float = 0.25
    radius_max: float = 1.0
    caution: float = 0.9
    radius_min: float = 1e-4
    residual: float = 1e-5
    patience: int = 6
    progress: float = 0.02
    retreats: int = 20
    depth: float = 2.0
    kick: float = 0.15
    seed: int = 0


@dataclass(frozen=True)
class SqpTrial:
    """Holds a feasible step that the model expects to pay."""

    place: ConstraintPoint  # where it leads
    predicted: float  # expected decrease of the loss
    rows: Ints  # ids of the constraints that the quadratic program knew
    multipliers: Floats  # their multipliers


def sqp(problem: CountedProblem, x0: Floats, options: SqpOptions) -> Result:
    """Runs descents from the start and then from inside the feasible set around the best design.

    The optimum is nearly a vertex of the feasible set, and there are many: a descent that starts
    again from inside chooses another, most often a better one.
    """
    place = feasible_start(problem, x0, options.radius_max)
    point = problem.simulate(place)
    if isinstance(point, SimulationError):
        raise point
    residual = problem.stationarity(point).residual
    problem.record(place, point, True, options.radius, residual)
    reason = Descent(problem, point, options).run()
    random = np.random.default_rng(options.seed)
    for _ in range(options.retreats):
        if problem.remaining < RESTART_COST * options.patience:
            break
        inside = _restart_from_interior(problem, options, random)
        if inside is not None:
            reason = Descent(problem, inside, options).run()
    if problem.finished is None and options.retreats:
        reason = _polish(problem, options)
    return problem.result(problem.finished or reason)


def _polish(problem: CountedProblem, options: SqpOptions) -> str:
    """Spends what is left of the evaluations on the best design."""
    assert problem.best is not None
    last = replace(options, caution=0.0, patience=options.evaluations)
    return Descent(problem, problem.best, last).run()


def _restart_from_interior(
    problem: CountedProblem, options: SqpOptions, random: np.random.Generator
) -> EvaluatedPoint | None:
    """Simulates a design in the interior of the feasible set, near the best one kicked."""
    assert problem.best is not None
    shift = random.uniform(-options.kick, options.kick, problem.best.x.shape)
    place = interior_design(problem, problem.best.x + shift, options.depth, options.radius_max)
    if place is None:
        return None
    outcome = problem.simulate(place)
    problem.record(place, outcome, isinstance(outcome, EvaluatedPoint), options.depth, np.nan)
    return outcome if isinstance(outcome, EvaluatedPoint) else None


class Descent:
    """Descends from one design by trust-region steps until it stalls."""

    def __init__(self, problem: CountedProblem, point: EvaluatedPoint, options: SqpOptions) -> None:
        self.problem = problem
        self.options = options
        self.point = point
        self.residual = problem.stationarity(point).residual
        self.steps = 0
        self.radius = options.radius
        self.losses = [point.loss]
        steepest = float(np.abs(point.gradient).max())
        self.model = QuasiNewton(len(point.x), max(steepest, 1e-300) / self.radius)

    def run(self) -> str:
        """Descends, and returns why it stopped."""
        while self.problem.finished is None:
            if self.residual <= self.options.residual:
                return "stationary"
            if self._stalled():
                return "no further progress"
            self._step()
        return self.problem.finished

    def _stalled(self) -> bool:
        if self.radius < self.options.radius_min:
            return True
        recent = self.losses[-1 - self.options.patience :]
        gained = recent[0] - recent[-1]
        full = len(recent) > self.options.patience
        return full and gained < self.options.progress * abs(recent[-1])

    def _step(self) -> None:
        trial = self._propose()
        if trial is None:
            self.radius /= 2
            return
        outcome = self.problem.simulate(trial.place)
        used = self.radius
        if isinstance(outcome, SimulationError):
            self.radius /= 4
            accepted = False
        else:
            accepted = self._update_trust_region(trial, outcome)
        if accepted:
            self.residual = self.problem.stationarity(self.point).residual
        self.steps += 1
        self.losses.append(self.point.loss)
        self.problem.record(trial.place, outcome, accepted, used, self.residual)

    def _propose(self) -> SqpTrial | None:
        """Proposes the model's best step within the radius, made feasible; None if none is."""
        point, radius = self.point, self.radius
        spendable = (1 - self._margin_share()) * point.values
        rows = reachable(spendable, point.jacobian, radius)
        found = dense_step(
            self.model.matrix,
            point.gradient,
            point.jacobian[rows],
            -spendable[rows],
            np.maximum(self.problem.lower - point.x, -radius),
            np.minimum(self.problem.upper - point.x, radius),
            self.problem.unit,
        )
        if found is None:
            return None
        place = project(self.problem, point.x + found.step, radius)
        if place is None:
            return None
        # The model of the Lagrangian already counts what the projection will cost.
        predicted = self.model.reduction(point.gradient, found.step)
        return SqpTrial(place, predicted, rows, found.multipliers) if predicted > 0 else None

    def _margin_share(self) -> float:
        """Returns the share of every margin that the next step must leave.

        Constraints that become active early steer the descent into poor optima.
        """
        return self.options.caution * CAUTION_DECAY**self.steps

    def _update_trust_region(self, trial: SqpTrial, outcome: EvaluatedPoint) -> bool:
        """Updates model and radius by a simulated step, and accepts it if the loss decreased."""
        step = outcome.x - self.point.x
        ratio = (self.point.loss - outcome.loss) / trial.predicted
        if self._changed_branch(step, outcome, trial.predicted):
            self.radius /= 4
            return self._move(outcome, ratio)
        jacobian_change = outcome.jacobian[trial.rows] - self.point.jacobian[trial.rows]
        change = outcome.gradient - self.point.gradient - jacobian_change.T @ trial.multipliers
        self.model.update(step, change)
        length = float(np.abs(step).max())
        if ratio < SHRINK:
            self.radius = min(self.radius, length) / 2
        elif ratio > GROW and length > 0.9 * self.radius:
            self.radius = min(2 * self.radius, self.options.radius_max)
        return self._move(outcome, ratio)

    def _changed_branch(self, step: Floats, outcome: EvaluatedPoint, predicted: float) -> bool:
        """Detects a loss of another branch of solutions, which tells nothing of this one.

        Along one branch the trapezoidal rule recovers the change of the loss from its slopes.
        """
        change = outcome.loss - self.point.loss
        explained = float((self.point.gradient + outcome.gradient) @ step) / 2
        unexplained = abs(change - explained)
        return unexplained > predicted and unexplained > UNEXPLAINED_SHARE * max(
            abs(change), abs(explained)
        )

    def _move(self, outcome: EvaluatedPoint, ratio: float) -> bool:
        if ratio <= ACCEPT:
            return False
        self.point = outcome
        return True
