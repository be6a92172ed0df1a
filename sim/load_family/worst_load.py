"""Searches the worst loads of a family for a design, by the gradient from many starts."""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from sim.core import Floats, SimulationError
from sim.load_family.family import LoadFamily

LOG = logging.getLogger(__name__)

LEAST_DISTANCE = 0.02
"""Distance of two places along an axis of the unit cube below which they are one load."""


@dataclass(frozen=True)
class SearchOptions:
    """Holds how the worst load is searched."""

    samples: int = 16  # loads spread over each set-up, of which the losses alone are computed
    ascents: int = 3  # searches by the gradient, from the worst of these
    evaluations: int = 8  # ... of so many losses with their gradient each, at most.
    seed: int = 0  # of the samples of the first search


@dataclass(frozen=True)
class FoundLoad:
    """Holds a load that a search ended at."""

    place: Floats  # (n,) in the family
    loss: float  # there
    start: Floats  # (n,) where the search started


def spread_places(family: LoadFamily, count: int, seed: int) -> Floats:
    """Spreads places (count, n) evenly over a family (Sobol' points, scrambled by the seed)."""
    from scipy.stats import qmc

    power = int(np.ceil(np.log2(max(count, 1))))
    return family.centred(qmc.Sobol(family.size, rng=seed).random_base2(power)[:count])


def ascend(
    loss: Callable[[Floats], tuple[float, Floats]], start: Floats, evaluations: int
) -> FoundLoad:
    """Searches the load of the greatest loss near a place, by projected quasi-Newton steps.

    A load that cannot be simulated counts as harmless, with a warning. The search goes by the loss
    over that at its start, as the stopping rule of L-BFGS-B is relative to 1 at least.

    Args:
        loss: of a place, with its gradient (n,).
        start: (n,).
        evaluations: about so many, at most.
    """
    from scipy.optimize import minimize

    best, unit = FoundLoad(start, -np.inf, start), 0.0

    def negative(place: Floats) -> tuple[float, Floats]:
        nonlocal best, unit
        try:
            value, slope = loss(place)
        except SimulationError as failure:
            LOG.warning("a load at %s cannot be simulated: %s", place, failure)
            return 0.0, np.zeros_like(place)
        if value > best.loss:
            best = FoundLoad(place.copy(), value, start)
        unit = unit or abs(value) or 1.0
        return -value / unit, -slope / unit

    minimize(
        negative, start, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * len(start),
        options={"maxfun": evaluations, "ftol": 1e-4},
    )  # fmt: skip
    return best


def search_worst(
    value: Callable[[Floats], float],
    loss: Callable[[Floats], tuple[float, Floats]],
    family: LoadFamily,
    options: SearchOptions,
    known: Iterable[Floats] = (),
) -> list[FoundLoad]:
    """Searches the worst loads of a family, from the worst of spread ones; the worst comes first.

    Args:
        value: loss at a place (n,).
        loss: the same with its gradient.
        family: the loads.
        options: of the search.
        known: places to start from besides, if they are among the worst.
    """
    samples = options.samples * len(family.setups)
    starts = [*known, *spread_places(family, samples, options.seed)]

    def tried(place: Floats) -> float:
        try:
            return value(place)
        except SimulationError as failure:
            LOG.warning("a load at %s cannot be simulated: %s", place, failure)
            return -np.inf

    order = np.argsort([-tried(start) for start in starts], kind="stable")
    chosen: list[Floats] = []
    for start in (starts[k] for k in order):
        if all(np.abs(start - other).max() > 10 * LEAST_DISTANCE for other in chosen):
            chosen.append(start)
    found = [ascend(loss, start, options.evaluations) for start in chosen[: options.ascents]]
    return sorted(found, key=lambda each: -each.loss)
