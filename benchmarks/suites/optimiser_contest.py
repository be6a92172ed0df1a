"""Compares optimisers on the same problems: every evaluation counted, timed and judged alike."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal, NamedTuple

import nlopt
import numpy as np
import xarray as xr
from scipy.optimize import BFGS, NonlinearConstraint, minimize

from benchmarks.harness import CandidateError, MeasuringLimits, Run, Sample, Tell, Worker, padded
from benchmarks.scenes import load_cases
from sim.constraints import ConstraintVector
from sim.core import Floats, SimulationError
from sim.optimise import MmaOptions, SqpOptions, minimise, stationarity
from sim.scene import Evaluator, make_plan

REACH = 3.0
"""Bound of every variable, mm."""
FEASIBLE = 1e-3
"""Largest violation of a design that counts, mm: below what can be made."""
FAILURE_FACTOR = 10.0
"""Loss over the first that stands for a design whose simulation fails."""


class BudgetSpentError(Exception):
    """Reports that the evaluations or the time are used up."""


@dataclass
class BudgetedProblem:
    """Counts the evaluations of a problem."""

    evaluate: Callable[[Floats], tuple[float, Floats, Floats]]  # loss, gradient and more
    constraints: ConstraintVector  # values >= 0 and Jacobian of a design
    n_variables: int  # of the design
    evaluations: int
    seconds: float
    designs: list[Floats] = field(default_factory=list)  # of every evaluation
    losses: list[float] = field(default_factory=list)
    clock: list[float] = field(default_factory=list)
    _start: float = field(default_factory=time.process_time)
    _known: tuple[float, Floats] | None = None

    def __call__(self, design: Floats) -> tuple[float, Floats, Floats]:
        """Evaluates loss, gradient and more; the last design again is no new evaluation.

        Raises:
            BudgetSpentError: no more may be asked for.
            SimulationError: the simulation failed.
        """
        if len(self.losses) >= self.evaluations:
            raise BudgetSpentError("evaluations used up")
        if time.process_time() - self._start > self.seconds:
            raise BudgetSpentError("time used up")
        self.designs.append(np.array(design))
        self.losses.append(np.nan)
        self.clock.append(time.process_time() - self._start)
        found = self.evaluate(self.designs[-1])
        self.losses[-1] = found[0]
        self.clock[-1] = time.process_time() - self._start
        return found

    def plain(self, design: Floats) -> tuple[float, Floats]:
        """Evaluates for optimisers that know of no failures: one is a bad loss."""
        if self.designs and np.array_equal(design, self.designs[-1]) and self._known:
            return self._known
        try:
            loss, gradient, _ = self(design)
        except SimulationError:
            loss, gradient = FAILURE_FACTOR * self.losses[0], np.zeros(self.n_variables)
        self._known = loss, np.array(gradient)
        return self._known


class OptimiserHistory(NamedTuple):
    """Holds the history of an optimiser, evaluation by evaluation."""

    loss: Floats  # as evaluated
    violation: Floats  # mm
    clock: Floats  # s of processor time since the start
    best: Floats  # of the best feasible design so far
    residual: Floats  # its KKT residual, mm
    final: Floats  # loss of the best feasible design, evaluated afresh


def judge(
    asked: BudgetedProblem, reference_loss: Callable[[Floats], tuple[float, Floats, Floats]]
) -> OptimiserHistory:
    """Judges a contest that is over; ``reference_loss`` is the loss and gradient to judge by."""
    losses = np.array(asked.losses)
    places = [asked.constraints(design) for design in asked.designs]
    violation = np.maximum([-float(values.min()) for values, _ in places], 0.0)
    best, residual = np.full((2, len(losses)), np.nan)
    steepest = float(np.abs(reference_loss(asked.designs[0])[1]).max())
    bound = np.full(asked.n_variables, REACH)
    champion, final = np.inf, np.nan
    for number, design in enumerate(asked.designs):
        if violation[number] <= FEASIBLE and losses[number] < champion:
            champion = losses[number]
            final, gradient, _ = reference_loss(design)
            judge = stationarity(gradient, *places[number], design, -bound, bound, steepest)
            residual[number:] = judge.residual
        best[number] = champion if np.isfinite(champion) else np.nan
    return OptimiserHistory(
        losses, violation, np.array(asked.clock), best, residual, np.array(final)
    )


def _own_optimiser(method: Literal["sqp", "mma"], asked: BudgetedProblem) -> None:
    options = {"sqp": SqpOptions, "mma": MmaOptions}[method](evaluations=asked.evaluations)
    start = np.zeros(asked.n_variables)
    minimise(method, asked, asked.constraints, start, (-REACH, REACH), options)


def _scipy_optimiser(method: str, asked: BudgetedProblem) -> None:
    of, options = asked.constraints, {"maxiter": float(asked.evaluations)}
    limits: Any = NonlinearConstraint(of.values, 0.0, np.inf, jac=lambda x: of(x)[1], hess=BFGS())
    if method == "SLSQP":
        limits = {"type": "ineq", "fun": of.values, "jac": lambda x: of(x)[1].toarray()}
        options["ftol"] = 1e-9
    minimize(
        asked.plain,
        np.zeros(asked.n_variables),
        jac=True,
        method=method,
        bounds=[(-REACH, REACH)] * asked.n_variables,
        constraints=limits,
        options=options,
    )


def _nlopt_optimiser(algorithm: str, asked: BudgetedProblem) -> None:
    def loss(design: Floats, slope: Floats) -> float:
        value, gradient = asked.plain(design)
        if slope.size:
            slope[:] = gradient
        return value

    def limits(result: Floats, design: Floats, slope: Floats) -> None:
        values, jacobian = asked.constraints(design)
        result[:] = -values
        if slope.size:
            slope[:] = -jacobian.toarray()

    made = nlopt.opt(getattr(nlopt, algorithm), asked.n_variables)
    made.set_min_objective(loss)
    made.add_inequality_mconstraint(limits, np.full(asked.constraints.n_constraints, 1e-8))
    made.set_lower_bounds(-REACH)
    made.set_upper_bounds(REACH)
    if algorithm == "LD_AUGLAG":
        within = nlopt.opt(nlopt.LD_CCSAQ, asked.n_variables)  # its L-BFGS fails here
        within.set_ftol_rel(1e-3)
        made.set_local_optimizer(within)
    made.optimize(np.zeros(asked.n_variables))


NLOPT = ("MMA", "CCSAQ", "SLSQP", "AUGLAG")
OPTIMISERS: dict[str, Callable[[BudgetedProblem], None]] = {
    "own sqp": partial(_own_optimiser, "sqp"),
    "own mma": partial(_own_optimiser, "mma"),
    **{
        f"scipy {method}": partial(_scipy_optimiser, method) for method in ("SLSQP", "trust-constr")
    },
    **{f"nlopt {name}": partial(_nlopt_optimiser, f"LD_{name}") for name in NLOPT},
}
"""trust-constr is an interior-point method here, AUGLAG an augmented Lagrangian over CCSAQ."""


@dataclass(frozen=True)
class OptimiserBudget:
    """Bounds each optimiser: evaluations, and processor time in s."""

    evaluations: int = 60
    seconds: float = 120.0


def prepare(name: str, budget: OptimiserBudget, optimiser: str) -> Run:
    """Prepares one optimiser on a scene's design problem, judged."""
    scene, limits = load_cases.designed(name)
    plan = make_plan(scene)
    evaluate = Evaluator(scene, plan)
    constraints = ConstraintVector(scene.space, limits)
    start = np.zeros(scene.space.n_variables)
    evaluate(start)
    constraints(start)

    def run() -> Sample:
        asked = BudgetedProblem(
            evaluate, constraints, len(start), budget.evaluations, budget.seconds
        )
        with suppress(BudgetSpentError):
            OPTIMISERS[optimiser](asked)
        return Sample(judge(asked, evaluate)._asdict(), {})

    return run


def measure(name: str, budget: OptimiserBudget, limits: MeasuringLimits, tell: Tell) -> xr.Dataset:
    """Returns the dataset ``contest`` of a scene, without its attributes."""
    del limits
    histories: list[OptimiserHistory] = []
    outcomes: list[str] = []
    for optimiser in OPTIMISERS:
        with Worker(partial(prepare, name, budget), 3 * budget.seconds) as worker:
            try:
                worker.prepare(optimiser)
                histories.append(OptimiserHistory(**worker.run().sample.values))
                outcomes.append("measured")
            except CandidateError as failed:
                histories.append(OptimiserHistory(*(np.zeros(0),) * 5, final=np.array(np.nan)))
                outcomes.append(str(failed))
        tell(f"{optimiser}: {histories[-1].final:.4g} ({outcomes[-1]})")
    dims = ("optimiser", "evaluation")
    return xr.Dataset(
        {
            **{
                name: (dims, padded([getattr(history, key) for history in histories]))
                for key, name in _NAMES.items()
            },
            "final_loss": ("optimiser", np.array([float(each.final) for each in histories])),
            "outcome": ("optimiser", outcomes),
        },
        {"optimiser": list(OPTIMISERS)},
    )


_NAMES = {"loss": "loss", "violation": "violation", "clock": "cpu_time", "best": "best_loss"}
_NAMES["residual"] = "kkt_residual"
"""Variables of the dataset, by attributes of the history."""
