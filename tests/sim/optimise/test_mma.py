from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sim.core import SimulationError
from sim.optimise import MmaOptions, Result, minimise
from tests.sim.optimise.known_problems import Known, cantilever, corner, many, shifted_bowl


def solve(known: Known, **changes: float) -> Result:
    options = replace(MmaOptions(evaluations=100, residual=1e-5), **changes)  # type: ignore[arg-type]
    return minimise("mma", known.loss, known.constraints, known.start, known.bounds, options)


@pytest.mark.parametrize(
    ("known", "tolerance"),
    [(corner(), 1e-5), (shifted_bowl(), 1e-4), (cantilever(), 5e-3)],
    ids=["corner", "bowl", "cantilever"],
)
def test_known_optima(known: Known, tolerance: float) -> None:
    found = solve(known)
    np.testing.assert_allclose(found.x, known.optimum, atol=tolerance)
    assert found.violation == 0.0


def test_hundreds_of_constraints() -> None:
    known = many(40, 120)
    found = solve(known)
    np.testing.assert_allclose(found.x, known.optimum, atol=5e-2)
    assert found.loss == pytest.approx(known.loss(known.optimum)[0], rel=1e-4)


def test_every_simulated_design_is_feasible_and_the_accepted_ones_improve() -> None:
    found = solve(corner())
    assert all(e.violation == 0.0 for e in found.evaluations)
    assert (np.diff([e.loss for e in found.evaluations if e.accepted]) < 0).all()


def test_failed_evaluations_bring_the_asymptotes_closer() -> None:
    known = cantilever()
    failures: list[np.ndarray] = []

    def fragile(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        if 0 < len(failures) < 3 or (not failures and x[0] > 5.5):
            failures.append(x)
            raise SimulationError("no convergence")
        return known.loss(x)

    found = minimise(
        "mma", fragile, known.constraints, known.start, known.bounds, MmaOptions(evaluations=60)
    )
    failed = [e for e in found.evaluations if e.failure]
    assert len(failed) == 3
    radii = [e.radius for e in failed]
    assert radii[0] > radii[1] > radii[2]
    np.testing.assert_allclose(found.x, known.optimum, atol=1e-2)
