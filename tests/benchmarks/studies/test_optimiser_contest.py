"""Every optimiser of the contest gets to work, and is judged by designs that keep the limits."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.studies.optimiser_contest import FEASIBLE, OPTIMISERS, OptimiserBudget, prepare


@pytest.mark.parametrize("optimiser", OPTIMISERS)
def test_an_optimiser_lowers_the_loss(optimiser: str) -> None:
    course = prepare("small_push", OptimiserBudget(evaluations=30), optimiser)().values
    best = course["best"][np.isfinite(course["best"])]
    assert len(course["loss"]) <= 30
    assert np.all(np.diff(best) <= 0.0)
    assert course["final"] == pytest.approx(best[-1], rel=1e-6)
    assert course["final"] < 0.9 * course["loss"][0]
    feasible = course["loss"][course["violation"] <= FEASIBLE]
    assert feasible.min() == best[-1]
