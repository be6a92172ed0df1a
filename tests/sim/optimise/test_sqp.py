from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

import sim
from sim.optimise import (
    Evaluation,
    InfeasibleStartError,
    Result,
    UnconfirmedError,
    minimise,
    stationarity,
)
from sim.optimise.minimisation import Method
from sim.optimise.quasi_newton import DAMPING, QuasiNewton
from tests.sim.optimise import known_problems as problems
from tests.tables import some

EXACT = sim.SqpOptions(evaluations=150, retreats=0, residual=1e-6, progress=1e-9)
OPTIONS: dict[Method, Any] = {"sqp": EXACT, "mma": sim.MmaOptions(evaluations=100, residual=1e-5)}
KNOWN = {
    "rosenbrock": (problems.rosenbrock_in_disc(), {"sqp": 1e-5}),
    "corner": (problems.corner(), {"sqp": 1e-5, "mma": 1e-5}),
    "bowl": (problems.shifted_bowl(), {"sqp": 1e-6, "mma": 1e-4}),
    "cantilever": (problems.cantilever(), {"sqp": 1e-4, "mma": 5e-3}),
}
"""Problems, and how near each method comes to their optima."""


def solved(known: problems.Known, method: Method = "sqp", **changes: float) -> Result:
    options = replace(OPTIONS[method], **changes)
    return minimise(method, known.loss, known.constraints, known.start, known.bounds, options)


@pytest.mark.parametrize(
    ("name", "method"),
    [
        pytest.param(n, m, marks=[pytest.mark.slow] if (n, m) == ("cantilever", "mma") else [])
        for n, (_, by) in KNOWN.items()
        for m in by
    ],
)
def test_known_optima(name: str, method: Method) -> None:
    known, tolerance = KNOWN[name][0], KNOWN[name][1][method]
    found = solved(known, method)
    np.testing.assert_allclose(found.x, known.optimum, atol=tolerance)
    assert found.violation == 0.0
    assert method == "mma" or found.stationarity.residual <= 1e-5


def test_unconstrained_rosenbrock() -> None:
    found = minimise("sqp", problems.rosenbrock, None, np.array([-1.2, 1.0]), options=EXACT)
    np.testing.assert_allclose(found.x, [1, 1], atol=1e-3)
    assert len(found.evaluations) < 60


@pytest.mark.parametrize(
    ("method", "size", "accuracy"),
    some([("sqp", (100, 500), 1e-5), ("mma", (40, 120), 1e-4)], 1),
)
def test_hundreds_of_constraints(method: Method, size: tuple[int, int], accuracy: float) -> None:
    known = problems.many(*size)
    found = solved(known, method)
    np.testing.assert_allclose(found.x, known.optimum, atol=2e-2)
    assert found.loss == pytest.approx(known.loss(known.optimum)[0], rel=accuracy)
    assert len(found.evaluations) <= 100


@pytest.mark.parametrize("method", OPTIONS)
def test_simulated_designs_are_feasible_and_seen_and_accepted_ones_improve(method: Method) -> None:
    known, seen = problems.corner(), list[Evaluation]()
    asked = (known.loss, known.constraints, known.start)
    found = minimise(method, *asked, options=OPTIONS[method], callback=seen.append)
    assert tuple(seen) == found.evaluations
    assert all(evaluation.violation == 0.0 for evaluation in seen)
    assert [evaluation.number for evaluation in seen] == list(range(len(seen)))
    assert (np.diff([each.loss for each in seen if each.accepted]) < 0).all()


def test_losses_decrease_and_steps_respect_radius_and_bounds() -> None:
    found = solved(problems.rosenbrock_in_disc())
    accepted = [e.loss for e in found.evaluations if e.accepted]
    assert (np.diff(accepted) < 0).all()
    assert found.loss == min(accepted) == found.evaluations[found.best].loss
    radius = 0.1
    found = solved(problems.shifted_bowl(), radius=radius, radius_max=radius)
    designs = np.array([e.x for e in found.evaluations])
    assert np.abs(np.diff(designs, axis=0)).max() <= radius + 1e-7
    assert np.abs(designs).max() <= 1.0


@pytest.mark.parametrize("method", OPTIONS)
def test_tiny_losses_are_minimised_like_others(method: Method) -> None:
    known = problems.many(20, 50)

    def tiny(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        loss, slope, _ = known.loss(x)
        return 1e-13 * loss, 1e-13 * slope, np.zeros(0)

    found = solved(replace(known, loss=tiny), method)
    np.testing.assert_allclose(found.x, known.optimum, atol=2e-2)
    assert 1e13 * found.loss == pytest.approx(known.loss(known.optimum)[0], rel=1e-3)


def test_infeasible_start_is_moved_first() -> None:
    known = problems.corner()
    found = minimise("sqp", known.loss, known.constraints, np.array([2.5, -1.0]), options=EXACT)
    assert found.evaluations[0].violation == 0.0
    np.testing.assert_allclose(found.x, known.optimum, atol=1e-5)


@pytest.mark.parametrize("method", ["sqp", "mma"])
def test_contradictory_constraints_are_named(method: Method) -> None:
    def never(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.array([1.0, -1.0 - x @ x]), np.stack([0 * x, -2 * x])

    with pytest.raises(InfeasibleStartError, match="constraint 1") as caught:
        minimise(method, problems.rosenbrock, never, np.array([0.3, 0.2]))
    assert caught.value.constraint == 1
    assert caught.value.violation >= 1.0


def test_failed_evaluations_are_rejected_and_teach_nothing() -> None:
    """The loss cannot be computed in part of the plane; the poisoned gradient must not matter."""
    poisoned: list[int] = []

    def fragile(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        if len(poisoned) < 3 and x[1] > 0.6:
            poisoned.append(1)
            raise sim.SimulationError("step 3 did not converge at unit 12")
        return problems.rosenbrock(x)

    found = minimise("sqp", fragile, problems.in_disc, np.array([-1.0, 0.5]), options=EXACT)
    np.testing.assert_allclose(found.x, problems.rosenbrock_in_disc().optimum, atol=1e-4)
    failed = [e for e in found.evaluations if e.failure is not None]
    assert len(failed) == 3
    assert all(np.isnan(e.loss) and not e.accepted for e in failed)
    assert "unit 12" in str(failed[0].failure)
    after = {e.number + 1: e.radius / 4 for e in failed}
    radii = {e.number: e.radius for e in found.evaluations}
    assert all(radii[number] <= radius * (1 + 1e-12) for number, radius in after.items())


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_the_model_stays_positive_definite(seed: int) -> None:
    """Powell's damping: an update never leaves less than a fifth of the model's own curvature."""
    random = np.random.default_rng(seed)
    model = QuasiNewton(4, 1.0)
    model.update(first := random.normal(size=4), first)  # learns the scale
    for _ in range(5):
        step, change = random.normal(size=4), random.normal(size=4)
        before = float(step @ model.matrix @ step)
        model.update(step, change)
        assert np.linalg.eigvalsh(model.matrix)[0] > 0
        left = float(step @ model.matrix @ step)
        assert left == pytest.approx(max(float(step @ change), DAMPING * before), rel=1e-6)


@pytest.mark.parametrize("method", ["sqp", "mma"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_losses_that_are_not_finite_count_as_failures(method: Method, bad: float) -> None:
    def sometimes(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        value, slope, aux = problems.rosenbrock(x)
        return (bad if x[0] > 0.5 else value), slope, aux

    options: Any = {
        "sqp": sim.SqpOptions(evaluations=40, retreats=0),
        "mma": sim.MmaOptions(evaluations=12),
    }
    found = minimise(
        method, sometimes, problems.in_disc, np.array([-1.0, 0.5]), options=options[method]
    )
    assert np.isfinite(found.loss)
    assert found.x[0] <= 0.5


@pytest.mark.parametrize("method", ["sqp", "mma"])
def test_a_start_that_fails_is_an_error(method: Method) -> None:
    def broken(_: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        raise sim.SimulationError("no equilibrium")

    with pytest.raises(sim.SimulationError, match="no equilibrium"):
        minimise(method, broken, problems.in_disc, np.array([-1.0, 0.5]))


@pytest.mark.parametrize("method", ["sqp", "mma"])
def test_budget_and_target_stop_the_run(method: Method) -> None:
    make: Any = {"sqp": sim.SqpOptions, "mma": sim.MmaOptions}[method]
    start = np.array([-1.0, 0.5])
    short = minimise(
        method, problems.rosenbrock, problems.in_disc, start, options=make(evaluations=5)
    )
    assert len(short.evaluations) == 5
    assert short.reason == "evaluations used up"
    known = problems.cantilever()
    good = minimise(
        method, known.loss, known.constraints, known.start, known.bounds, make(target=1.4)
    )
    assert good.reason == "target reached"
    assert good.loss <= 1.4


def test_kicks_leave_a_poor_optimum_and_keep_the_best() -> None:
    """Two valleys: a small kick finds the deeper one; the best design is returned, not the last."""

    def wavy(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        value = float(x @ x + 0.05 * np.sum(1 - np.cos(30 * x)))
        return value, 2 * x + 1.5 * np.sin(30 * x), np.zeros(0)

    start = np.array([0.45, -0.38])
    still = minimise("sqp", wavy, None, start, options=sim.SqpOptions(retreats=0, radius=0.02))
    kicked = minimise(
        "sqp", wavy, None, start, options=sim.SqpOptions(retreats=8, radius=0.02, evaluations=200)
    )
    assert kicked.loss < still.loss
    assert kicked.loss == min(e.loss for e in kicked.evaluations)
    assert kicked.evaluations[: len(still.evaluations)][-1].loss == still.evaluations[-1].loss
    kick = kicked.evaluations[len(still.evaluations)].x - still.x
    assert 0.0 < np.abs(kick).max() <= sim.SqpOptions().kick


@pytest.mark.parametrize("method", ["sqp", "mma"])
def test_the_best_design_is_that_whose_confirmed_loss_is_the_best(method: Method) -> None:
    """Low losses are not found again: the lowest not at all, others with half as much again."""
    known = problems.corner()

    def confirm(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        loss, gradient, aux = known.loss(x)
        if loss < -1.4:
            raise sim.SimulationError("out of reach")
        return loss + (0.5 if loss < -1.2 else 0.0), gradient, aux

    found = minimise(method, known.loss, known.constraints, known.start, confirm=confirm)
    losses = np.array([each.loss for each in found.evaluations if each.violation == 0.0])
    assert losses.min() < -1.4
    reachable = losses[losses >= -1.4]
    confirmed = reachable + np.where(reachable < -1.2, 0.5, 0.0)
    assert found.loss == confirmed.min() == confirm(found.x)[0]
    assert (found.evaluations[found.best].x == found.x).all()


def test_a_run_of_which_nothing_is_confirmed_says_why() -> None:
    known = problems.corner()

    def confirm(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        raise sim.SimulationError(f"snaps with {x.size} variables")

    with pytest.raises(UnconfirmedError, match="snaps with"):
        minimise("sqp", known.loss, known.constraints, known.start, confirm=confirm)


def test_runs_are_reproducible_bit_for_bit() -> None:
    runs = [solved(problems.many(40, 120), retreats=2, evaluations=60) for _ in range(2)]
    assert runs[0].x.tobytes() == runs[1].x.tobytes()
    assert [e.loss for e in runs[0].evaluations] == [e.loss for e in runs[1].evaluations]


def test_options_of_another_method_are_refused() -> None:
    with pytest.raises(ValueError, match="MmaOptions are not options of the method 'sqp'"):
        minimise("sqp", problems.rosenbrock, None, np.zeros(2), options=sim.MmaOptions())


def test_multipliers_of_a_known_optimum() -> None:
    known = problems.corner()
    _, gradient, _ = known.loss(known.optimum)
    assert known.constraints is not None
    values, jacobian = known.constraints(known.optimum)

    free = np.full(2, np.inf)
    at = stationarity(gradient, values, csr_array(jacobian), known.optimum, -free, free, 1.0)
    np.testing.assert_allclose(at.multipliers, [1 / 3, 1 / 6], atol=1e-8)
    assert at.residual < 1e-8
    away = np.array([0.0, 0.5])
    values, jacobian = known.constraints(away)
    off = stationarity(gradient, values, csr_array(jacobian), away, -free, free, 1.0)
    assert off.residual == pytest.approx(1.0)
    assert len(off.active) == 0


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_bounded_bowls_end_at_the_clipped_bottom(seed: int) -> None:
    random = np.random.default_rng(seed)
    bottom, weight = random.normal(size=6) * 2, random.uniform(0.2, 3, 6)

    def loss(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return float(weight @ (x - bottom) ** 2), 2 * weight * (x - bottom), np.zeros(0)

    found = minimise("sqp", loss, None, np.zeros(6), (-1.0, 1.0), EXACT)
    np.testing.assert_allclose(found.x, np.clip(bottom, -1, 1), atol=1e-5)


def test_jumps_to_another_branch_teach_nothing() -> None:
    """Every third evaluation finds another equilibrium, with slopes that are not this one's."""
    known, count = problems.many(40, 120), [0]

    def jumping(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        loss, slope, aux = known.loss(x)
        count[0] += 1
        return (loss + 3.0, -20 * slope, aux) if count[0] % 3 == 0 else (loss, slope, aux)

    found = minimise(
        "sqp", jumping, known.constraints, known.start, options=replace(EXACT, evaluations=120)
    )
    least = known.loss(known.optimum)[0]
    assert found.loss - least < 1e-3 * (known.loss(known.start)[0] - least)
