import numpy as np
import pytest

from sim.core import Floats
from sim.linalg.banded import factorise, number_free_dofs, solve
from sim.structure import Lattice
from tests.sim.structures import mixed_polygons, rotating_squares


def random_band(n: int, width: int, shift: float) -> tuple[Floats, Floats]:
    """Lower band storage of a random symmetric matrix, and the matrix itself."""
    rng = np.random.default_rng(0)
    full = np.zeros((n, n))
    band = np.zeros((n, width + 1))
    for column in range(n):
        for below in range(min(width + 1, n - column)):
            band[column, below] = rng.normal() + (shift if below == 0 else 0.0)
            full[column + below, column] = full[column, column + below] = band[column, below]
    return band, full


@pytest.mark.parametrize(("n", "width"), [(40, 7), (5, 4), (3, 2), (12, 0)])
def test_solution_of_a_banded_system(n: int, width: int) -> None:
    band, full = random_band(n, width, shift=20.0)
    right = np.random.default_rng(1).normal(size=n)
    solution = right.copy()
    assert factorise(band)
    solve(band, solution)
    np.testing.assert_allclose(full @ solution, right, atol=1e-12)


def test_an_indefinite_matrix_is_noticed() -> None:
    band, full = random_band(30, 5, shift=1.0)
    assert np.linalg.eigvalsh(full).min() < 0
    assert not factorise(band)


def test_a_matrix_with_nan_is_not_positive_definite() -> None:
    band, _ = random_band(10, 2, shift=20.0)
    band[4, 0] = np.nan
    assert not factorise(band)


@pytest.mark.parametrize(
    "lattice", [rotating_squares(6), mixed_polygons()], ids=["squares", "mixed"]
)
def test_numbering_covers_the_free_dofs_within_its_bandwidth(lattice: Lattice) -> None:
    held = np.array([0, 1, 2, 9, 13])
    free, width = number_free_dofs(lattice.n_units, lattice.ligament_units, held)
    assert (free[held] == -1).all()
    np.testing.assert_array_equal(np.sort(free[free >= 0]), np.arange(3 * lattice.n_units - 5))
    for pair in lattice.ligament_units:
        coupled = free.reshape(-1, 3)[pair].ravel()
        coupled = coupled[coupled >= 0]
        assert coupled.max() - coupled.min() <= width


def test_a_long_strip_is_numbered_along_its_short_side() -> None:
    pairs = [(k, k + 20) for k in range(60)] + [(k, k + 1) for k in range(80) if k % 20 < 19]
    _, width = number_free_dofs(80, np.array(pairs), np.array([], dtype=int))
    assert width <= 3 * 6
