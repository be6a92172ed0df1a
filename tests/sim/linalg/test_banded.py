import numpy as np
import pytest

from sim.core import Floats
from sim.linalg.banded import factorise, number_free_dofs, solve


def random_band(n: int, width: int) -> tuple[Floats, Floats]:
    """Lower band storage of a random symmetric matrix, and the matrix itself."""
    rng = np.random.default_rng(0)
    full = np.zeros((n, n))
    band = np.zeros((n, width + 1))
    for column in range(n):
        for below in range(min(width + 1, n - column)):
            band[column, below] = rng.normal() + (20.0 if below == 0 else 0.0)
            full[column + below, column] = full[column, column + below] = band[column, below]
    return band, full


@pytest.mark.parametrize(("n", "width"), [(40, 7), (5, 4), (3, 2), (12, 0)])
def test_solution_of_a_banded_system(n: int, width: int) -> None:
    band, full = random_band(n, width)
    right = np.random.default_rng(1).normal(size=n)
    solution = right.copy()
    assert factorise(band)
    solve(band, solution)
    np.testing.assert_allclose(full @ solution, right, atol=1e-12)


def test_a_long_strip_is_numbered_along_its_short_side() -> None:
    pairs = [(k, k + 20) for k in range(60)] + [(k, k + 1) for k in range(80) if k % 20 < 19]
    _, width = number_free_dofs(80, np.array(pairs), np.array([], dtype=int))
    assert width <= 3 * 6
