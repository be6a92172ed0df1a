"""Minimises by any of the methods."""

from typing import Literal

import numpy as np

from sim.core import Floats
from sim.optimise.mma import MmaOptions, mma
from sim.optimise.problem import Callback, Constrain, CountedProblem, Evaluate, Result
from sim.optimise.sqp import SqpOptions, sqp

Method = Literal["sqp", "mma"]


def minimise(
    method: Method,
    evaluate: Evaluate,
    constraints: Constrain | None,
    x0: Floats,
    bounds: tuple[Floats | float, Floats | float] | None = None,
    options: SqpOptions | MmaOptions | None = None,
    callback: Callback | None = None,
    confirm: Evaluate | None = None,
) -> Result:
    """Minimises a loss subject to constraints >= 0 and returns the best feasible design met.

    Both methods are deterministic and decide nothing by the clock: with a journal around
    ``evaluate`` (sim.optimise.journal) an interrupted run resumes exactly.

    Args:
        method: "sqp" (trust-region SQP with feasible iterates) or "mma" (moving asymptotes).
        evaluate: loss, gradient (n,) and further numbers of a design; may raise SimulationError, a
            design that is then avoided without learning from it. The start must succeed.
        constraints: values (m,) and Jacobian (m, n) of a design, all in comparable units (mm).
        x0: (n,) start; it is moved to a feasible design first if it is not one, which is logged.
        bounds: lower and upper bounds of the variables.
        options: of the method.
        callback: called with each Evaluation as it is recorded.
        confirm: what ``evaluate`` should return without help of earlier evaluations, if it has
            that; the best design by this loss is returned.

    Raises:
        InfeasibleStartError: no feasible design near the start.
        SimulationError: the start cannot be simulated.
        UnconfirmedError: no design is confirmed.
        ValueError: options of another method.
    """
    start = np.array(x0, dtype=float)
    lower, upper = (-np.inf, np.inf) if bounds is None else bounds
    chosen = options if options is not None else {"sqp": SqpOptions, "mma": MmaOptions}[method]()
    problem = CountedProblem(
        evaluate,
        constraints,
        np.broadcast_to(np.asarray(lower, dtype=float), start.shape).copy(),
        np.broadcast_to(np.asarray(upper, dtype=float), start.shape).copy(),
        chosen.evaluations,
        chosen.target,
        callback,
        confirm,
    )
    if method == "sqp" and isinstance(chosen, SqpOptions):
        return sqp(problem, start, chosen)
    if method == "mma" and isinstance(chosen, MmaOptions):
        return mma(problem, start, chosen)
    raise ValueError(f"{type(chosen).__name__} are not options of the method {method!r}")
