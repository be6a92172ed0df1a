from collections.abc import Callable
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sim.core import SimulationError
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic, PrescribedMotion, Solver, differentiable_motion, solve_case
from sim.time_integration import ExplicitSolver, ImplicitSolver
from tests.sim.structures import Rig, rotating_squares

TIMES = np.linspace(0.0, 0.01, 41)
RIG = Rig(rotating_squares(3), np.array([0, 8]), np.array([4]), Harmonic(0.5, 50.0, 0.6))
SOLVERS: dict[str, Solver] = {
    "static": StaticSolver(RIG.topology, TIMES[10::10]),
    "implicit": ImplicitSolver(RIG.topology, TIMES, TIMES[10::10]),
    "explicit": ExplicitSolver(RIG.topology, 0.01, 300, TIMES[10::10]),
}
EVERY_SOLVER = pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS.keys())


def drives(*directions: float) -> tuple[PrescribedMotion, ...]:
    return tuple(PrescribedMotion(RIG.driven, Harmonic(0.5, 50.0, angle)) for angle in directions)


@EVERY_SOLVER
def test_cases_are_independent_of_each_other_and_of_threads(solver: Solver) -> None:
    together = differentiable_motion(solver, RIG.parameters(RIG.numbers), drives(0.0, 0.6, 1.2))
    assert together.displacement.shape == (3, 4, 9, 3)
    threaded = differentiable_motion(
        replace(solver, threads=3),  # type: ignore[type-var]
        RIG.parameters(RIG.numbers),
        drives(0.0, 0.6, 1.2),
    )
    for one, other in zip(together, threaded, strict=True):
        np.testing.assert_array_equal(one, other)
    alone = solve_case(solver, RIG.values, drives(0.6)[0])[0]
    np.testing.assert_array_equal(together.displacement[1].reshape(4, -1), alone)


@EVERY_SOLVER
def test_gradients_of_cases_add_up(solver: Solver) -> None:
    def loss(directions: tuple[float, ...]) -> Callable[[jax.Array], jax.Array]:
        def of_design(design: jax.Array) -> jax.Array:
            values = RIG.parameters(RIG.numbers._replace(design=design))
            return jnp.sum(
                differentiable_motion(solver, values, drives(*directions)).displacement ** 2
            )

        return of_design

    zero = RIG.numbers.design
    both = jax.grad(loss((0.0, 0.6)))(zero)
    each = [jax.grad(loss((angle,)))(zero) for angle in (0.0, 0.6)]
    np.testing.assert_allclose(both, each[0] + each[1], rtol=1e-12, atol=1e-15)


@EVERY_SOLVER
def test_held_units_follow_their_drive_exactly(solver: Solver) -> None:
    response = differentiable_motion(solver, RIG.parameters(RIG.numbers), drives(0.6))
    times = np.asarray(solver.output_times)
    along = np.array([np.cos(0.6), np.sin(0.6), 0.0])
    wave = 0.5 * np.sin(100 * np.pi * times)
    rate = 50 * np.pi * np.cos(100 * np.pi * times)
    np.testing.assert_allclose(response.displacement[0, :, 4], np.outer(wave, along), atol=1e-12)
    np.testing.assert_allclose(response.velocity[0, :, 4], np.outer(rate, along), atol=1e-9)
    np.testing.assert_array_equal(response.displacement[0][:, [0, 8]], 0.0)


@EVERY_SOLVER
def test_results_are_float64_whatever_goes_in(solver: Solver) -> None:
    small = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), RIG.parameters(RIG.numbers))
    response = differentiable_motion(solver, small, drives(0.6))
    assert response.displacement.dtype == response.velocity.dtype == jnp.float64
    exact = differentiable_motion(solver, RIG.parameters(RIG.numbers), drives(0.6))
    np.testing.assert_allclose(response.displacement, exact.displacement, rtol=0, atol=1e-4)


@EVERY_SOLVER
def test_gradient_by_a_float32_design(solver: Solver) -> None:
    def loss(design: jax.Array) -> jax.Array:
        values = RIG.parameters(RIG.numbers._replace(design=design))
        return jnp.sum(differentiable_motion(solver, values, drives(0.6)).displacement ** 2)

    zero = RIG.numbers.design
    exact, single = jax.grad(loss)(zero), jax.grad(loss)(zero.astype(jnp.float32))
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, exact, rtol=1e-5, atol=1e-6 * np.abs(exact).max())


@EVERY_SOLVER
def test_a_structure_without_area_is_refused(solver: Solver) -> None:
    with pytest.raises(SimulationError, match="not everywhere a finite number"):
        solve_case(solver, RIG.values._replace(mass=np.full((9, 3), np.nan)), drives(0.6)[0])
