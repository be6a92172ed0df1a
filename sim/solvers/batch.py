"""Solves many independent cases: over all cores, memory flat, failures kept with a reason."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from sim.core import Floats, SimulationError
from sim.solvers.load_cases import solve_case
from sim.solvers.prescribed_motion import PrescribedMotion
from sim.solvers.solver import Solver
from sim.structure import ConcreteParameters

R = TypeVar("R")


@dataclass(frozen=True)
class Case:
    """Holds one structure under one drive, the solver to use, and its number among the cases."""

    values: ConcreteParameters
    drive: PrescribedMotion
    solver: Solver
    number: int = 0


@dataclass(frozen=True)
class Solved:
    """Holds a case that was simulated."""

    case: Case  # the case
    displacement: Floats  # (n_times, n_units, 3)
    velocity: Floats  # (n_times, n_units, 3)
    record: Any  # the solver's


@dataclass(frozen=True)
class Outcome(Generic[R]):
    """Holds what came of a case: the measure's value, or why there is none."""

    value: R | None
    failure: str | None = None
    error: SimulationError | None = None


Measure = Callable[[Solved], R]
"""Reduces a simulated case to what is kept of it."""


def run_batch(cases: Iterable[Case], measure: Measure[R], threads: int = 1) -> Iterator[Outcome[R]]:
    """Yields the outcome of every case, in order, while others are still computed.

    Cases are taken from the iterable as cores fall free, at most two per thread ahead, and only
    what ``measure`` returns is kept of them. A case whose simulation fails yields its reason.
    """
    if threads == 1:
        yield from (_outcome(case, measure) for case in cases)
        return
    with ThreadPoolExecutor(threads) as pool:
        ahead: deque[Future[Outcome[R]]] = deque()
        for case in cases:
            ahead.append(pool.submit(_outcome, case, measure))
            if len(ahead) >= 2 * threads:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()


def _outcome(case: Case, measure: Measure[R]) -> Outcome[R]:
    shape = (-1, case.solver.topology.n_units, 3)
    try:
        displacement, velocity, record = solve_case(case.solver, case.values, case.drive)
        solved = Solved(case, displacement.reshape(shape), velocity.reshape(shape), record)
        return Outcome(measure(solved))
    except SimulationError as error:  # of the measure too: it may simulate with finer steps
        return Outcome(None, str(error), error)
