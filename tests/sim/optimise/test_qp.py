"""Quadratic programs are solved to rounding, at every scale of what is minimised."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from sim.optimise.qp import Quadratic, dense_step, shortest_step

ROUNDING = 1e-9


class Program:
    """A random program with a step that is allowed, and copies of some constraints.

    Mirrored constraints of a symmetric design coincide in its variables.
    """

    def __init__(self, seed: int, size: int, scale: float = 1.0) -> None:
        random = np.random.default_rng(seed)
        factor = random.normal(size=(size, size))
        self.hessian = scale * (factor @ factor.T / size + 0.01 * np.eye(size))
        self.gradient = scale * random.normal(size=size)
        rows = random.normal(size=(2 * size, size)) * (random.random((2 * size, size)) < 0.3)
        self.dense = np.vstack([rows, rows[: size // 2]])
        self.matrix = sp.csr_array(self.dense)
        self.lower, self.upper = -np.full(size, 0.4), np.full(size, 0.3)
        allowed = random.uniform(self.lower, self.upper)
        slack = np.maximum(random.uniform(-0.3, 0.5, len(rows)), 0.0)
        self.least = self.dense @ allowed - np.concatenate([slack, slack[: size // 2]])

    @property
    def limits(self) -> tuple[sp.csr_array, np.ndarray, np.ndarray, np.ndarray]:
        return self.matrix, self.least, self.lower, self.upper

    def check(self, found: Quadratic, slope: np.ndarray, scale: float) -> None:
        """The step keeps the limits, and they alone hold back the slope there."""
        step, multipliers = found.step, found.multipliers
        spare = self.dense @ step - self.least
        assert spare.min() > -ROUNDING
        assert (step >= self.lower).all()
        assert (step <= self.upper).all()
        assert (multipliers >= 0.0).all()
        assert np.abs(multipliers * spare).max() < ROUNDING * scale
        left = slope - self.dense.T @ multipliers
        assert (left[step < self.upper - ROUNDING] > -ROUNDING * scale).all()
        assert (left[step > self.lower + ROUNDING] < ROUNDING * scale).all()


@given(st.integers(0, 10**6), st.integers(1, 30), st.sampled_from([1e-6, 1.0, 1e6]))
def test_the_step_of_a_model_is_its_minimiser(seed: int, size: int, scale: float) -> None:
    given = Program(seed, size, scale)
    found = dense_step(given.hessian, given.gradient, *given.limits, unit=scale)
    assert found is not None
    given.check(found, given.gradient + given.hessian @ found.step, scale)


@given(st.integers(0, 10**6), st.integers(1, 30))
def test_the_shortest_step_is_the_nearest(seed: int, size: int) -> None:
    given = Program(seed, size)
    found = shortest_step(given.gradient, *given.limits)
    assert found is not None
    given.check(found, found.step - given.gradient, 1.0)


def test_a_tiny_step_is_the_shortest() -> None:
    """Projections often mend a ten-millionth of a millimetre."""
    along = np.array([3.0, 4.0])
    wide = np.full(2, 1.0)
    found = shortest_step(np.zeros(2), sp.csr_array(along[None]), np.array([5e-7]), -wide, wide)
    assert found is not None
    np.testing.assert_allclose(found.step, along / 5.0 * 1e-7, rtol=1e-3)


def test_a_program_without_an_allowed_step_has_no_solution() -> None:
    rows = sp.csr_array(np.array([[1.0, 0.0], [-1.0, 0.0]]))
    least, wide = np.array([0.1, 0.1]), np.full(2, 1.0)
    assert shortest_step(np.zeros(2), rows, least, -wide, wide) is None
    assert dense_step(np.eye(2), np.ones(2), rows, least, -wide, wide) is None


@pytest.mark.parametrize("size", [3, 40])
def test_a_program_without_constraints_is_held_by_its_bounds(size: int) -> None:
    none, wide = sp.csr_array((0, size)), np.full(size, 0.5)
    found = dense_step(np.eye(size), np.arange(float(size)) - 1.2, none, np.zeros(0), -wide, wide)
    assert found is not None
    np.testing.assert_allclose(found.step, np.clip(1.2 - np.arange(size), -0.5, 0.5), atol=1e-12)


def test_a_model_that_is_not_convex_has_no_step() -> None:
    none, wide = sp.csr_array((0, 2)), np.full(2, 0.5)
    assert dense_step(-np.eye(2), np.ones(2), none, np.zeros(0), -wide, wide) is None
