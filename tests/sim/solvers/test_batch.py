from collections.abc import Iterator

import numpy as np
import pytest

from sim.core import SimulationError
from sim.quasistatics import StaticSolver
from sim.solvers import Case, LinearRamp, Outcome, PrescribedMotion, Solved, run_batch
from tests.sim.structures import Rig, rotating_squares


def cases(amplitudes: list[float]) -> list[Case]:
    corners, middle = np.array([0, 4, 20, 24]), np.array([12])
    rig = Rig(rotating_squares(5), corners, middle, LinearRamp(1.0, 1.0))
    solver = StaticSolver(rig.topology, np.ones(1))
    return [
        Case(rig.values, PrescribedMotion(middle, LinearRamp(amplitude, 1.0)), solver)
        for amplitude in amplitudes
    ]


def largest(solved: Solved) -> float:
    return float(solved.displacement[0, 12, 0])


@pytest.mark.parametrize("threads", [1, 2])
def test_outcomes_come_in_order_and_failures_with_their_reason(threads: int) -> None:
    amplitudes = [0.1, 0.2, float("nan"), 0.4, 0.5, 0.6]
    outcomes: list[Outcome[float]] = list(run_batch(cases(amplitudes), largest, threads))
    values = np.array([outcome.value for outcome in outcomes], dtype=float)
    np.testing.assert_allclose(values, amplitudes, rtol=1e-12)
    assert outcomes[2].value is None
    assert "finite" in str(outcomes[2].failure)


def test_a_case_whose_measure_finds_no_motion_has_failed() -> None:
    def estimated(solved: Solved) -> float:
        if largest(solved) > 0.15:
            raise SimulationError("no equilibrium found with finer steps")
        return largest(solved)

    outcomes = list(run_batch(cases([0.1, 0.2]), estimated))
    assert [outcome.failure for outcome in outcomes] == [None, str(outcomes[1].error)]
    assert outcomes[1].value is None


def test_cases_are_taken_as_cores_fall_free() -> None:
    taken = 0

    def counted() -> Iterator[Case]:
        nonlocal taken
        for case in cases([0.1] * 12):
            taken += 1
            yield case

    outcomes = run_batch(counted(), largest, threads=2)
    next(outcomes)
    assert taken <= 4
    assert len(list(outcomes)) == 11
