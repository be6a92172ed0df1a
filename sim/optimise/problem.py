"""Counts and records the evaluations of a minimisation, and holds its result."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from sim.core import Floats, SimulationError
from sim.optimise.kkt import Stationarity, stationarity

Evaluate = Callable[[Floats], tuple[float, Floats, Floats]]
"""Design (n,) -> loss, gradient (n,), further numbers worth keeping, such as the single cases."""

Constrain = Callable[[Floats], tuple[Floats, "sp.csr_array | Floats"]]
"""Design (n,) -> values (m,), required to be >= 0, and their Jacobian (m, n), sparse or dense.

It may raise SimulationError, for a design that is then avoided. Where it has a method `named`, the
log takes from it the kind of a constraint, by number, and what it is about.
"""

Callback = Callable[["Evaluation"], None]

CONFIRMED = 1e-6
"""Relative difference up to which a loss counts as found again."""

LEAST_SLOPE = 1e-6
"""Largest slope of a loss, at the start, that absolute tolerances of 1e-10 still suit."""

log = logging.getLogger(__name__)


class UnconfirmedError(SimulationError):
    """Reports that none of the designs evaluated is confirmed."""


class InfeasibleStartError(ValueError):
    """Reports that no design that meets all constraints was found near the start.

    Attributes:
        constraint: index of the most violated constraint at the start, within its bounds.
        violation: by how much.
    """

    def __init__(self, constraint: int, violation: float) -> None:
        super().__init__(
            f"the start violates constraint {constraint} by {violation:.3g} and no design nearby "
            "meets them all; relax the limits or start elsewhere"
        )
        self.constraint = constraint
        self.violation = violation


@dataclass(frozen=True)
class Evaluation:
    """Records one evaluation of the loss."""

    number: int  # 0 for the first
    x: Floats  # (n,) the design
    loss: float  # NaN if the evaluation failed
    aux: Floats  # further numbers returned with the loss, empty if it failed
    violation: float  # largest constraint violation, 0 if feasible
    accepted: bool  # whether the method moved there
    radius: float  # largest change of a variable that the method allowed
    kkt_residual: float  # of the last accepted design (see sim.optimise.kkt)
    failure: str | None = None  # why the evaluation failed, or None


@dataclass(frozen=True)
class Result:
    """Holds the best feasible design found, and how it was found."""

    x: Floats  # (n,) the design
    loss: float  # as evaluated there
    gradient: Floats
    aux: Floats
    violation: float  # largest constraint violation, 0 unless no feasible design was met
    stationarity: Stationarity  # multipliers and residual of the optimality conditions there
    best: int  # its number in ``evaluations``
    evaluations: tuple[Evaluation, ...]  # all of them, in order
    reason: str  # why the method stopped


@dataclass(frozen=True)
class ConstraintPoint:
    """Holds a design with its constraints, not yet simulated."""

    x: Floats
    values: Floats
    jacobian: sp.csr_array

    @property
    def violation(self) -> float:
        """Returns the largest amount by which a constraint is missed."""
        return max(0.0, -float(self.values.min(initial=np.inf)))


@dataclass(frozen=True)
class EvaluatedPoint(ConstraintPoint):
    """Holds a simulated design."""

    number: int
    loss: float
    gradient: Floats
    aux: Floats


@dataclass
class CountedProblem:
    """Counts and records the evaluations of one minimisation and remembers the best design."""

    evaluate: Evaluate  # the loss
    constrain: Constrain | None  # the constraints, or None
    lower: Floats  # (n,) lower bounds, or infinite
    upper: Floats  # (n,) upper bounds, or infinite
    budget: int  # largest number of evaluations
    target: float = -np.inf  # loss below which a feasible design is good enough
    callback: Callback | None = None  # called with each record
    confirm: Evaluate | None = None  # loss without help of earlier evaluations
    evaluations: list[Evaluation] = field(default_factory=list)
    start: ConstraintPoint | None = None  # within its bounds, before it was made feasible
    best: EvaluatedPoint | None = None
    steepest: float | None = None  # entry of the first gradient, scale of residuals

    @property
    def finished(self) -> str | None:
        """Returns the reason to stop, or None while evaluations may follow."""
        if self.best is not None and self.best.violation == 0 and self.best.loss <= self.target:
            return "target reached"
        return "evaluations used up" if len(self.evaluations) >= self.budget else None

    @property
    def remaining(self) -> int:
        """Counts the evaluations that may follow."""
        return 0 if self.finished else self.budget - len(self.evaluations)

    @property
    def unit(self) -> float:
        """Returns the unit of the loss for absolute tolerances: 1, or less for one that is tiny."""
        return min(1.0, (self.steepest or 1.0) / LEAST_SLOPE)

    def place(self, x: Floats) -> ConstraintPoint:
        """Evaluates the constraints."""
        if self.constrain is None:
            return ConstraintPoint(x, np.zeros(0), sp.csr_array((0, len(x))))
        values, jacobian = self.constrain(x)
        found = ConstraintPoint(x, np.asarray(values, dtype=float), sp.csr_array(jacobian))
        self.start = self.start or found
        return found

    def simulate(self, place: ConstraintPoint) -> EvaluatedPoint | SimulationError:
        """Evaluates the loss; a failure is returned, for the method to step back from.

        A loss or gradient that is not finite counts as a failure.
        """
        number = len(self.evaluations)
        try:
            loss, gradient, aux = self.evaluate(place.x.copy())
        except SimulationError as failure:
            return failure
        if not (np.isfinite(loss) and np.isfinite(gradient).all()):
            return SimulationError("the loss or its gradient is not finite")
        gradient, aux = np.array(gradient, dtype=float), np.array(aux, dtype=float)
        point = EvaluatedPoint(
            place.x, place.values, place.jacobian, number, float(loss), gradient, aux.ravel()
        )
        if self.steepest is None:
            self.steepest = float(np.abs(point.gradient).max(initial=0.0)) or 1.0
        if self.best is None or (point.violation, point.loss) < (
            self.best.violation,
            self.best.loss,
        ):
            self.best = point
        return point

    def record(
        self,
        place: ConstraintPoint,
        outcome: EvaluatedPoint | SimulationError,
        accepted: bool,
        radius: float,
        residual: float,
    ) -> None:
        """Appends the evaluation to the history and reports it."""
        loss, aux, failure = (
            (outcome.loss, outcome.aux, None)
            if isinstance(outcome, EvaluatedPoint)
            else (np.nan, np.zeros(0), str(outcome))
        )
        self.evaluations.append(
            Evaluation(
                number=len(self.evaluations),
                x=place.x,
                loss=loss,
                aux=aux,
                violation=place.violation,
                accepted=accepted,
                radius=radius,
                kkt_residual=residual,
                failure=failure,
            )
        )
        if self.callback is not None:
            self.callback(self.evaluations[-1])

    def stationarity(self, point: EvaluatedPoint) -> Stationarity:
        """Measures the optimality of a simulated design."""
        return stationarity(
            point.gradient,
            point.values,
            point.jacobian,
            point.x,
            self.lower,
            self.upper,
            self.steepest or 1.0,
        )

    def result(self, reason: str) -> Result:
        """Returns the best design that is confirmed; the first evaluation must have succeeded."""
        best = self._confirmed()
        return Result(
            x=best.x,
            loss=best.loss,
            gradient=best.gradient,
            aux=best.aux,
            violation=best.violation,
            stationarity=self.stationarity(best),
            best=best.number,
            evaluations=tuple(self.evaluations),
            reason=reason,
        )

    def _confirmed(self) -> EvaluatedPoint:
        """Returns the best design; with ``confirm``, the one whose loss by that is the best."""
        if self.best is None:
            raise RuntimeError("no evaluation succeeded")
        if self.confirm is None:
            return self.best
        found: EvaluatedPoint | None = None
        last: SimulationError | None = None
        succeeded = (each for each in self.evaluations if each.failure is None)
        for each in sorted(succeeded, key=lambda each: (each.violation, each.loss)):
            if found is not None and (found.violation, found.loss) <= (each.violation, each.loss):
                break
            try:
                loss, gradient, aux = self.confirm(each.x.copy())
                place = self.place(each.x)  # constraints may have learnt since
            except SimulationError as failure:
                log.warning("evaluation %d is not confirmed: %s", each.number, failure)
                last = failure
                continue
            if abs(loss - each.loss) > CONFIRMED * abs(each.loss):
                log.warning("evaluation %d is not confirmed: its loss is %.5g", each.number, loss)
            if found is None or (place.violation, loss) < (found.violation, found.loss):
                found = EvaluatedPoint(
                    place.x, place.values, place.jacobian, each.number, loss, gradient, aux
                )
        if found is None:
            raise UnconfirmedError(f"no design is confirmed by its path as it is reported: {last}")
        return found
