"""The interval of a reduction against that of drawn quantities."""

import numpy as np

from pipeline.comparison import compute_reduction


def test_the_interval_is_that_of_drawn_quantities() -> None:
    random = np.random.default_rng(0)
    before, after = (random.normal(mean, 0.05, 20000) for mean in (5.2, 1.9))
    ends = 1.96 * 0.05 * np.array([0.0, -1.0, 1.0])
    value, low, high = compute_reduction(5.2 + ends, 1.9 + ends)
    np.testing.assert_allclose(
        [low, high], np.quantile(1 - after / before, [0.025, 0.975]), atol=1e-3
    )
    assert value == 1 - 1.9 / 5.2


def test_a_one_sided_doubt_stays_on_its_side() -> None:
    value, low, high = compute_reduction(np.array([2.0, 2.0, 2.0]), np.array([1.0, 1.0, 1.2]))
    assert (value, high) == (0.5, 0.5)
    assert low == 0.4
