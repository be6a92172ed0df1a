import numpy as np
import pytest
import scipy.sparse as sp

from sim.core import SimulationError
from sim.optimise import MmaOptions, Result, minimise
from sim.optimise.mma_subproblem import Separable, UnsolvedError, minimise_separable
from tests.sim.optimise.known_problems import Known, cantilever, rosenbrock_in_disc
from tests.sim.optimise.test_sqp import solved
from tests.sim.structures import central


def solve(known: Known, **changes: float) -> Result:
    return solved(known, "mma", **changes)


def test_steps_that_raise_the_loss_are_not_taken() -> None:
    """A narrow bent valley: replacements promise there what the loss does not keep."""
    known = rosenbrock_in_disc()
    found = minimise("mma", known.loss, known.constraints, known.start,
                     options=MmaOptions(evaluations=60))  # fmt: skip
    refused = [e for e in found.evaluations if not e.accepted]
    assert refused
    assert all(e.failure is None for e in refused)
    assert (np.diff([e.loss for e in found.evaluations if e.accepted]) < 0).all()


@pytest.mark.parametrize(("seed", "reason"), [(36, "stationary"), (28, "no further progress")])
def test_no_design_is_simulated_again_where_none_better_is_promised(seed: int, reason: str) -> None:
    random = np.random.default_rng(seed)
    n, m = int(random.integers(2, 9)), int(random.integers(1, 14))
    matrix, bottom = random.normal(size=(n, n)), random.normal(size=n) * 2
    scale = 10.0 ** random.integers(-9, 10)
    normals, level = random.normal(size=(m, n)), random.uniform(0.05, 1, m)
    bend = random.uniform(0, 1)

    def loss(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        off = matrix @ x - bottom
        value, slope = (
            off @ off + 0.3 * np.sin(3 * x).sum(),
            2 * matrix.T @ off + 0.9 * np.cos(3 * x),
        )
        return float(scale * value), scale * slope, np.zeros(0)

    def constraints(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return level - normals @ x - bend * (x @ x), -normals - 2 * bend * x

    found = minimise("mma", loss, constraints, np.zeros(n), options=MmaOptions(evaluations=40))
    designs = np.array([e.x for e in found.evaluations])
    assert (np.diff(designs, axis=0) != 0.0).any(axis=1).all()
    assert found.reason == reason


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


def test_an_unsolved_subproblem_ends_with_the_best_design(monkeypatch: pytest.MonkeyPatch) -> None:
    solved: list[Separable] = []

    def fragile(subproblem: Separable) -> tuple[np.ndarray, np.ndarray]:
        solved.append(subproblem)
        if len(solved) > 8:
            raise UnsolvedError("no convergence")
        return minimise_separable(subproblem)

    monkeypatch.setattr("sim.optimise.mma.minimise_separable", fragile)
    found = solve(cantilever())
    assert found.reason == "no convergence"
    assert found.loss == min(e.loss for e in found.evaluations)
    assert found.violation == 0.0


def test_more_digits_than_there_are_is_an_error() -> None:
    with pytest.raises(UnsolvedError, match="asymptotes"):
        minimise_separable(separable(5, 3), tolerance=0.0)


def separable(size: int, count: int, seed: int = 0) -> Separable:
    """A random subproblem; its centre is feasible."""
    random = np.random.default_rng(seed)
    shape = (count + 1, size)
    up, down = (sp.csr_array(random.uniform(0, 1, shape) ** 3) for _ in range(2))
    return Separable(
        centre=np.zeros(size),
        distance=np.full(size, 1.0),
        low=np.full(size, -0.9),
        high=np.full(size, 0.9),
        up=up,
        down=down,
        at_centre=np.concatenate([[1.0], -random.uniform(0, 0.05, count)]),
    )


@pytest.mark.parametrize(("size", "count"), [(30, 6), (6, 30), (8, 0)])
def test_subproblem_satisfies_its_optimality_conditions(size: int, count: int) -> None:
    problem = separable(size, count)
    x, price = minimise_separable(problem)
    values = problem.values(x)[1:]
    slope = problem.slopes(x).T @ np.concatenate([[1.0], price])
    inside = (x > problem.low + 1e-6) & (x < problem.high - 1e-6)
    np.testing.assert_allclose(slope[inside], 0, atol=1e-6)
    assert (slope[x <= problem.low + 1e-6] >= -1e-6).all()
    assert (slope[x >= problem.high - 1e-6] <= 1e-6).all()
    assert (values <= 1e-7).all()
    np.testing.assert_allclose(price * values, 0, atol=1e-6)
    assert (price >= 0).all()


def test_subproblem_slopes_and_curvature_agree_with_differences() -> None:
    problem, x, way = separable(5, 3), np.linspace(-0.5, 0.5, 5), np.eye(5)[1]
    np.testing.assert_allclose(problem.values(problem.centre), problem.at_centre)
    weights = np.array([1.0, 0.3, 0.2, 0.7])
    slopes = central(lambda step: problem.values(x + step * way), 1e-5)
    np.testing.assert_allclose(problem.slopes(x).toarray()[:, 1], slopes, rtol=1e-7)
    bends = central(lambda step: (problem.slopes(x + step * way).T @ weights)[1], 1e-5)
    assert problem.curvature(x, weights)[1] == pytest.approx(bends, rel=1e-4)


def test_designs_whose_constraints_cannot_be_evaluated_are_avoided() -> None:
    """Beyond 0.6 there is no design; the optimum without that lies at 1."""

    def loss(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return float(((x - 1.0) ** 2).sum()), 2.0 * (x - 1.0), np.zeros(0)

    def constraints(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if x[0] > 0.6:
            raise SimulationError("it snaps")
        return np.array([2.0 - x.sum()]), -np.ones((1, 2))

    options = MmaOptions(evaluations=30)
    found = minimise("mma", loss, constraints, np.zeros(2), (-2.0, 2.0), options)
    assert 0.5 < found.x[0] <= 0.6
    assert found.loss < 0.2 * found.evaluations[0].loss


def test_a_fixed_variable_is_refused() -> None:
    known = rosenbrock_in_disc()
    room = np.array([1.0, 0.0])
    bounds = known.start - room, known.start + room
    with pytest.raises(ValueError, match="leave it out"):
        minimise("mma", known.loss, known.constraints, known.start, bounds)
