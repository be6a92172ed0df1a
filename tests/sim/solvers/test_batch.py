"""Many cases in one call: in order, failures with their reason, memory flat."""

from collections.abc import Iterator

import numpy as np
import pytest

from sim.core import SimulationError
from sim.energy import observe
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
def test_outcomes_come_in_order(threads: int) -> None:
    amplitudes = [0.1 * k for k in range(1, 8)]
    outcomes = list(run_batch(cases(amplitudes), largest, threads))
    values = np.array([outcome.value for outcome in outcomes], dtype=float)
    np.testing.assert_allclose(values, amplitudes, rtol=1e-12)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_failed_case_is_kept_with_its_reason(threads: int) -> None:
    three = cases([0.1, float("nan"), 0.2])
    outcomes: list[Outcome[float]] = list(run_batch(three, largest, threads))
    assert [outcome.value is None for outcome in outcomes] == [False, True, False]
    assert "finite" in str(outcomes[1].failure)


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


def test_energies_and_reactions_of_states() -> None:
    case = cases([0.5])[0]
    displacement, _, record = case.solver.forward(case.values, case.drive)
    motion = displacement.reshape(1, -1, 3)
    seen = observe(case.solver.topology, case.values, motion)
    assert record.stable.all()
    assert seen.strain_energy[0] > 0.0
    reaction = seen.reaction.reshape(-1)
    held = case.solver.topology.held
    assert np.isfinite(reaction[held]).all()
    assert np.isnan(np.delete(reaction, held)).all()
    balance = np.nansum(seen.reaction[0, :, :2], axis=0)
    np.testing.assert_allclose(balance, 0.0, atol=1e-9)
