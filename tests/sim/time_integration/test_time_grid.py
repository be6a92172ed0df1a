import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.time_integration import time_grid


@given(
    duration=st.floats(0.05, 3.0),
    first=st.floats(1e-4, 5e-3),
    growth=st.floats(1.05, 1.5),
    largest=st.floats(5e-3, 5e-2),
)
def test_graded_grids(duration: float, first: float, growth: float, largest: float) -> None:
    times = time_grid.graded(duration, first, growth, largest)
    steps = np.diff(times)
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(duration, rel=1e-12)
    assert (steps > 0).all()
    assert steps.max() <= largest * (1 + 1e-9)
    assert steps[0] <= first * (1 + 1e-9)
    assert (np.diff(steps) >= -1e-9).all()
    assert (steps[1:] / steps[:-1]).max() <= growth * (1 + 1e-9)


def test_halving_and_splitting_keep_the_old_points() -> None:
    times = time_grid.graded(1.0, 1e-3, 1.2, 25e-3)
    halves = time_grid.halved(times)
    np.testing.assert_array_equal(halves[::2], times)
    np.testing.assert_allclose(np.diff(halves)[::2], np.diff(times) / 2)
    split = time_grid.split_steps(times, np.array([3]))
    np.testing.assert_array_equal(np.delete(split, 4), times)
    assert split[4] == (times[3] + times[4]) / 2


def test_dense_output_reproduces_cubics() -> None:
    times = np.array([0.0, 0.3, 0.4, 1.0])
    asked = np.array([0.0, 0.1, 0.3, 0.39, 0.7, 1.0])
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0])
    value, slope = time_grid.hermite_matrices(times, asked)
    states = np.concatenate([cubic(times), cubic.deriv()(times)])
    np.testing.assert_allclose(value @ states, cubic(asked), atol=1e-13)
    np.testing.assert_allclose(slope @ states, cubic.deriv()(asked), atol=1e-12)


@pytest.mark.parametrize("asked", [[0.0, 1.1], [-0.1, 1.0], [0.5, 0.4]])
def test_output_outside_of_the_run_or_out_of_order_is_refused(asked: list[float]) -> None:
    time_grid.check_output_times(np.array([0.0, 0.5, 0.5, 1.0 + 1e-12]), 1.0)
    with pytest.raises(ValueError, match="must ascend from 0 to 1 s"):
        time_grid.check_output_times(np.array(asked), 1.0)


def test_simpson_weights_and_stage_times() -> None:
    assert time_grid.simpson_weights(11, 2.0) @ np.linspace(0.0, 2.0, 11) ** 3 == pytest.approx(4.0)
    even = 3 * np.linspace(0.0, 2.0, 10) + 1
    assert time_grid.simpson_weights(10, 2.0) @ even == pytest.approx(8.0)
    times, nodes = np.array([0.0, 1.0, 3.0]), np.array([0.0, 0.5, 1.0])
    np.testing.assert_array_equal(time_grid.stage_times(times, nodes), [0.0, 0.5, 1.0, 2.0, 3.0])
