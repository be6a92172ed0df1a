"""Projects designs on the feasible set by shortest Newton steps."""

import logging

import numpy as np

from sim.core import Floats, SimulationError
from sim.optimise.problem import (
    Constrain,
    ConstraintPoint,
    CountedProblem,
    InfeasibleStartError,
)
from sim.optimise.qp import reachable, shortest_step

INSET = 1e-7
"""The projection aims this far inside (mm), so that rounding leaves no constraint violated."""

PATIENCE = 3
"""Rounds in which a projection gets half the way to the feasible set, unless it leads nowhere.

They are counted anew where a margin comes in sight, which was infinite, as loads beyond a snap are.
"""

DEPTH_STEPS = 10
"""Number of steps in which the margins of an interior design grow."""

log = logging.getLogger(__name__)


def project(
    problem: CountedProblem,
    x: Floats,
    reach: float,
    rounds: int = 12,
    depth: float = 0.0,
    patience: int = PATIENCE,
) -> ConstraintPoint | None:
    """Finds a design near ``x`` with every margin at least ``depth``; None if no round does.

    Each round is a shortest Newton step for the linearised constraints and changes no variable by
    more than ``reach``. The worst margin must come half the way in any ``patience`` rounds, unless
    it has come in sight in them. A design whose constraints cannot be evaluated is none.
    """
    missing: list[float] = []
    try:
        before = place = problem.place(np.clip(x, problem.lower, problem.upper))
        for _ in range(rounds):
            if _became_finite(before, place):
                missing.clear()
            missing.append(depth - float(place.values.min(initial=np.inf)))
            if missing[-1] <= 0.0:
                return place
            if len(missing) > patience and missing[-1] > 0.5 * missing[-1 - patience]:
                return None
            step = _newton_step(problem, place, reach, depth + INSET)
            if step is None:
                return None
            ahead = np.clip(place.x + step, problem.lower, problem.upper)
            before, place = place, problem.place(ahead)
    except SimulationError:
        return None
    return place if place.values.min(initial=np.inf) >= depth else None


def _became_finite(before: ConstraintPoint, place: ConstraintPoint) -> bool:
    """Tests whether the worst margin of a design was infinite at the one before."""
    return len(place.values) > 0 and bool(np.isinf(before.values[place.values.argmin()]))


def _newton_step(
    problem: CountedProblem, place: ConstraintPoint, reach: float, depth: float
) -> Floats | None:
    near = reachable(place.values - depth, place.jacobian, reach)
    found = shortest_step(
        np.zeros_like(place.x),
        place.jacobian[near],
        depth - place.values[near],
        np.maximum(problem.lower - place.x, -reach),
        np.minimum(problem.upper - place.x, reach),
    )
    return None if found is None else found.step


def interior_design(
    problem: CountedProblem, x: Floats, depth: float, reach: float
) -> ConstraintPoint | None:
    """Finds a design inside the feasible set, every margin at ``depth`` or as near as it goes.

    The way is followed in small steps, so that it leads to the part of the set that ``x`` is in.
    """
    place = project(problem, x, reach)
    for level in np.linspace(0.0, depth, DEPTH_STEPS + 1)[1:]:
        inner = None if place is None else project(problem, place.x, reach, depth=level)
        if inner is None:
            break
        place = inner
    return place


def feasible_design(constrain: Constrain, x: Floats, reach: float, rounds: int) -> Floats | None:
    """Projects a design vector on the feasible set; None if no round leads there."""
    unbounded = np.full(len(x), np.inf)
    place = project(CountedProblem(_no_loss, constrain, -unbounded, unbounded, 0), x, reach, rounds)
    return None if place is None else place.x


def _no_loss(design: Floats) -> tuple[float, Floats, Floats]:
    return 0.0, np.zeros_like(design), np.zeros(0)


def feasible_start(problem: CountedProblem, x: Floats, reach: float) -> ConstraintPoint:
    """Projects as ``project`` does, in many rounds and ever longer steps; logs the move.

    Raises:
        InfeasibleStartError: naming the worst constraint.
    """
    for factor in (1, 4, 16):
        place = project(problem, x, factor * reach, rounds=50, patience=50)
        if place is not None:
            _log_move(problem, place)
            return place
    start = problem.place(np.clip(x, problem.lower, problem.upper))
    worst = int(np.argmin(start.values))
    raise InfeasibleStartError(worst, -float(start.values[worst]))


def _log_move(problem: CountedProblem, place: ConstraintPoint) -> None:
    """Logs how far a start was moved, and which constraint it misses most."""
    start = problem.start
    if start is None or start.violation == 0.0:
        return
    worst = int(np.argmin(start.values))
    named = getattr(problem.constrain, "named", lambda number: ("constraint", number))
    kind, about = named(worst)
    log.info(
        "the start misses %s (%s) by %.3g: moved by up to %.3g mm, to where no limit is missed",
        kind,
        about,
        start.violation,
        np.abs(place.x - start.x).max(),
    )
