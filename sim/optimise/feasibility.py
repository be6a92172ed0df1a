"""Back to designs that meet every constraint, by the shortest way."""

from __future__ import annotations

import numpy as np

from sim.arrays import Floats
from sim.optimise.problem import InfeasibleStartError, Place, Problem
from sim.optimise.qp import reachable, shortest_step

INSET = 1e-7
"""The projection aims this far inside (mm), so that rounding leaves no constraint violated."""


def project(problem: Problem, x: Floats, reach: float, rounds: int = 12) -> Place | None:
    """Design near ``x`` with no violated constraint, or None if the rounds do not find one.

    Each round is a shortest Newton step for the linearised constraints and changes no variable by
    more than ``reach``.
    """
    place = problem.place(np.clip(x, problem.lower, problem.upper))
    for _ in range(rounds):
        if place.violation == 0.0:
            return place
        step = _newton(problem, place, reach)
        if step is None:
            return None
        place = problem.place(np.clip(place.x + step, problem.lower, problem.upper))
    return place if place.violation == 0.0 else None


def _newton(problem: Problem, place: Place, reach: float) -> Floats | None:
    near = reachable(place.values - INSET, place.jacobian, reach)
    found = shortest_step(
        np.zeros_like(place.x),
        place.jacobian[near],
        INSET - place.values[near],
        np.maximum(problem.lower - place.x, -reach),
        np.minimum(problem.upper - place.x, reach),
    )
    return None if found is None else found.step


def feasible_start(problem: Problem, x: Floats, reach: float) -> Place:
    """As ``project``, allowing many rounds and ever longer steps.

    Raises:
        InfeasibleStartError: naming the worst constraint.
    """
    for factor in (1, 4, 16):
        place = project(problem, x, factor * reach, rounds=50)
        if place is not None:
            return place
    start = problem.place(x)
    worst = int(np.argmin(start.values))
    raise InfeasibleStartError(worst, -float(start.values[worst]))
