import jax.numpy as jnp
import numpy as np
import pytest

import sim
from sim.solvers import held_dofs, held_values

TIMES = np.linspace(0.0, 2.0, 41)


def test_motions_are_the_authors() -> None:
    motion = np.asarray(sim.Harmonic(4.5, 2.0, np.deg2rad(30.0))(jnp.asarray(TIMES)))
    wave = 4.5 * np.sin(4 * np.pi * TIMES)
    wanted = np.stack([wave * np.sqrt(0.75), wave * 0.5, np.zeros(41)], axis=1)
    np.testing.assert_allclose(motion, wanted, atol=1e-12)
    motion = np.asarray(sim.TanhRamp(-15.0, 2.0)(jnp.asarray(TIMES)))
    wanted = -15.0 * (1 + np.tanh(6 * (2 * TIMES / 2.0 - 1))) / 2
    np.testing.assert_allclose(motion[:, 0], wanted, atol=1e-12)
    assert motion[-1, 0] / -15.0 == pytest.approx(0.99999386, abs=1e-8)
    motion = np.asarray(sim.LinearRamp(3.0, 2.0, np.pi / 2)(jnp.asarray(TIMES)))
    np.testing.assert_allclose(motion[:, 1], 1.5 * TIMES, atol=1e-12)
    np.testing.assert_allclose(motion[:, 0], 0.0, atol=1e-12)


def test_switched_on_harmonic_starts_from_rest_and_grows_to_the_full_sine() -> None:
    motion = np.asarray(sim.Harmonic(4.5, 2.0, 0.0, rise=0.05, delay=0.5)(jnp.asarray(TIMES)))
    assert np.abs(motion[TIMES < 0.2]).max() < 1e-4
    late = TIMES > 1.0
    wanted = 4.5 * np.sin(4 * np.pi * (TIMES[late] - 0.5))
    np.testing.assert_allclose(motion[late, 0], wanted, atol=1e-6)


def test_measured_series_are_interpolated_for_all_or_each() -> None:
    knots = np.array([0.0, 1.0, 2.0])
    series = sim.TimeSeries(knots, np.array([[0.0, 0, 0], [2.0, -1.0, 0.1], [2.0, 0, 0.3]]))
    motion = np.asarray(series(jnp.array([0.0, 0.5, 1.0, 1.5])))
    np.testing.assert_allclose(motion[1], [1.0, -0.5, 0.05])
    np.testing.assert_allclose(motion[3], [2.0, -0.5, 0.2])
    series = sim.TimeSeries(np.array([0.0, 2.0]), np.arange(12.0).reshape(2, 2, 3))
    held = held_dofs(np.array([0]), np.array([4, 2]))
    values = held_values(held, np.array([4, 2]), series(np.array([0.0, 2.0])))
    np.testing.assert_array_equal(held, [0, 1, 2, 6, 7, 8, 12, 13, 14])
    np.testing.assert_array_equal(values[:, :3], 0.0)
    np.testing.assert_array_equal(values[1, 3:], [9, 10, 11, 6, 7, 8])


@pytest.mark.parametrize(
    "motion",
    [sim.Harmonic(1.0, 2.0, 0.3), sim.LinearRamp(1.0, 2.0, 0.3), sim.TanhRamp(1.0, 2.0, 0.3)],
    ids=["harmonic", "linear", "tanh"],
)
def test_all_driven_units_follow_and_the_clamped_rest(motion: sim.MotionLaw) -> None:
    held = held_dofs(np.array([1]), np.array([0, 3]))
    values = held_values(held, np.array([0, 3]), motion(TIMES))
    one = motion(TIMES)
    np.testing.assert_array_equal(values, np.hstack([one, np.zeros_like(one), one]))
    with pytest.raises(ValueError, match="must be held"):
        held_values(held, np.array([2]), one)
    with pytest.raises(ValueError, match="listed twice"):
        held_values(held, np.array([0, 0]), one)
