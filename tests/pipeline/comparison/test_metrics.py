import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.comparison import compute_reduction, metrics
from pipeline.comparison.metrics import (
    METRICS,
    Pair,
    block_length,
    bootstrap,
    compute_metrics,
    estimate_metrics,
)

FRAMES, UNITS = 60, 30
TIME = np.arange(FRAMES) / 60
RMSE, NRMSE, CORRELATION, SHARE, SHIFT = range(len(METRICS))


def waves(lag: float = 0.0) -> np.ndarray:
    """Three-dof waves of units with phases of their own, at 2 Hz."""
    phase = np.linspace(0, 3, UNITS)[:, None] + np.array([0.0, 0.5, 1.0])
    return np.asarray(np.sin(4 * np.pi * (TIME[:, None, None] - lag) - phase))


def pair(noise: float, stated: float | None = None, lag: float = 0.0, seed: int = 0) -> Pair:
    simulated = waves()
    drawn = np.random.default_rng(seed).normal(0, noise, simulated.shape)
    sigma = np.full(simulated.shape, noise if stated is None else stated)
    return Pair(waves(lag) + drawn, simulated, sigma)


def test_noise_explains_the_residual_of_a_right_simulation_alone() -> None:
    found = estimate_metrics(pair(0.05), TIME, np.random.default_rng(0))
    np.testing.assert_allclose(found[0, SHARE], 1.0, atol=0.1)
    assert (found[1, SHARE] < 1).all()
    assert (found[2, SHARE] > 1).all()
    np.testing.assert_allclose(found[0, RMSE], 0.05, rtol=0.05)
    seen = pair(0.01)
    found = compute_metrics(seen._replace(simulated=1.2 * seen.simulated))
    assert (found[SHARE] < 0.02).all()
    np.testing.assert_allclose(found[NRMSE], 0.2, rtol=0.02)
    np.testing.assert_allclose(found[CORRELATION], 1.0, atol=1e-3)


@settings(max_examples=4, deadline=None)
@given(st.floats(-0.04, 0.04))
def test_a_known_shift_in_time_is_found(lag: float) -> None:
    found = estimate_metrics(pair(0.002, lag=lag), TIME, np.random.default_rng(1))
    np.testing.assert_allclose(found[0, SHIFT], lag, atol=3e-4)
    assert (found[1, SHIFT] <= found[0, SHIFT]).all()


def test_gaps_are_left_out_and_nothing_at_all_gives_no_number() -> None:
    whole = pair(0.05)
    holes = np.random.default_rng(3).random(whole.measured.shape) < 0.2
    found = compute_metrics(whole._replace(measured=np.where(holes, np.nan, whole.measured)))
    np.testing.assert_allclose(found[:SHIFT], compute_metrics(whole)[:SHIFT], rtol=0.05)
    empty = compute_metrics(whole._replace(measured=np.full_like(whole.measured, np.nan)))
    assert np.isnan(empty).all()
    none = whole.resample(np.arange(FRAMES), np.arange(0))
    assert np.isnan(estimate_metrics(none, None, np.random.default_rng(0))).all()
    assert np.isnan(estimate_metrics(pair(0.01), None, np.random.default_rng(0))[:, SHIFT]).all()


@pytest.mark.slow
def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    """Units off by amounts of their own, of a known mean square."""
    held = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        seen = pair(0.02, seed=seed).resample(np.arange(15), np.arange(UNITS))
        off = random.normal(0, 0.1, (1, UNITS, 3))
        _, low, high = bootstrap(
            seen._replace(measured=seen.measured + off), compute_metrics, random
        )
        truth = np.sqrt(0.1**2 + 0.02**2)
        held += int(((low[RMSE] <= truth) & (truth <= high[RMSE])).sum())
    assert held >= 0.85 * 120


def test_an_interval_leaves_as_much_out_on_either_side() -> None:
    copies = np.stack([np.arange(1001.0), np.full(1001, np.nan)], axis=1)
    ends = metrics.interval_ends(copies[::-1])
    np.testing.assert_allclose(ends[:, 0], [25.0, 975.0])
    assert np.isnan(ends[:, 1]).all()


@pytest.mark.parametrize(("kept", "longest"), [(0.0, 2), (0.9, 15)])
def test_blocks_are_as_long_as_residuals_remember(kept: float, longest: int) -> None:
    random = np.random.default_rng(0)
    residual = random.normal(size=(FRAMES, UNITS))
    for frame in range(1, FRAMES):
        residual[frame] += kept * residual[frame - 1]
    assert longest / 3 <= block_length(residual) <= longest


def test_an_interval_is_as_wide_as_residuals_that_remember_make_it() -> None:
    """The mean of n values that keep a share k of the last scatters by (1 + k) / (1 - k) / n."""
    frames, kept, widths = 400, 0.8, []
    for seed in range(8):
        random = np.random.default_rng(seed)
        drift = random.normal(0, np.sqrt(1 - kept**2), (frames, 1, 1))
        for frame in range(1, frames):
            drift[frame] += kept * drift[frame - 1]
        still = np.zeros_like(drift)
        _, low, high = bootstrap(
            Pair(drift, still, still), lambda copy: copy.measured.mean(axis=(0, 1)), random
        )
        widths.append(float(high[0] - low[0]))
    wanted = 2 * 1.96 * np.sqrt((1 + kept) / (1 - kept) / frames)
    assert 0.6 < np.median(widths) / wanted < 1.2


def test_the_interval_of_a_reduction_is_that_of_drawn_quantities() -> None:
    random = np.random.default_rng(0)
    before, after = (random.normal(mean, 0.05, 20000) for mean in (5.2, 1.9))
    ends = 1.96 * 0.05 * np.array([0.0, -1.0, 1.0])
    value, *found = compute_reduction(5.2 + ends, 1.9 + ends)
    drawn = np.quantile(1 - after / before, [0.025, 0.975])
    np.testing.assert_allclose(found, drawn, atol=1e-3)
    assert value == 1 - 1.9 / 5.2
    one_sided = compute_reduction(np.array([2.0, 2.0, 2.0]), np.array([1.0, 1.0, 1.2]))
    np.testing.assert_array_equal(one_sided, [0.5, 0.4, 0.5])


def test_a_value_that_noise_put_beyond_its_interval_has_no_end_on_that_side() -> None:
    found = compute_reduction(np.array([2.0, 1.9, 2.1]), np.array([0.1, 0.02, 0.06]))
    np.testing.assert_allclose(found, [0.95, 0.9475, 0.95 + np.hypot(0.04, 0.0025)])
