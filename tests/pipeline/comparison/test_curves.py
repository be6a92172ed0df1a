from functools import partial

import numpy as np
import pytest

from pipeline.comparison import curves
from pipeline.comparison.compared_quantities import (
    Quantity,
    largest_size,
    mean_approach,
    mean_displacement,
    mean_rotation,
    root_mean_square,
    square_sizes,
)

FRAMES, UNITS, NOISE = 60, 40, 0.02
TIME = np.arange(FRAMES) / 30
PHASE = np.linspace(0, 3, 3 * UNITS).reshape(UNITS, 3)
WAVES = np.sin(4 * np.pi * TIME[:, None, None] - PHASE)


def sides(measured: np.ndarray, noise: float = NOISE, gain: float = 1.0) -> curves.Sides:
    """Of waves that are seen with noise; the copies of the simulated side differ in size."""
    seen = measured + noise * np.random.default_rng(2).standard_normal(measured.shape)
    sigma = np.full(measured.shape, noise)
    copies = np.stack([share * gain * WAVES for share in np.linspace(0.9, 1.1, 64)])
    return curves.Sides(seen, sigma, gain * WAVES, gain * WAVES, copies, 0.95)


def curve(seen: curves.Sides, quantity: Quantity) -> np.ndarray:
    """The quantity's curve, with the first draws."""
    smooth = curves.smooth_motion(seen)
    return curves.quantity_curve(seen, smooth, quantity, np.random.default_rng(0))


def peaks(seen: curves.Sides) -> np.ndarray:
    """The peaks, with the first draws."""
    return curves.estimate_peaks(seen, curves.smooth_motion(seen), np.random.default_rng(0))


def test_peaks_between_frames_are_not_missed_of_units_often_seen() -> None:
    off = np.linspace(-0.5, 0.5, 33).reshape(11, 3)
    hill = 1 - 0.05 * (np.arange(-4, 5)[:, None, None] - off) ** 2
    np.testing.assert_allclose(curves.peak_to_peak(hill), 1 - hill.min(axis=0), atol=1e-12)
    np.testing.assert_allclose(curves.peak_to_peak(-hill), 1 - hill.min(axis=0), atol=1e-12)
    np.testing.assert_allclose(curves.peak_to_peak(WAVES), 2.0, atol=0.02)
    seen = WAVES.copy()
    seen[:9, 0], seen[20, 1] = np.nan, np.nan
    found = curves.peak_to_peak(seen)
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1:], 2.0, atol=0.02)


def test_intervals_of_peaks_hold_the_truth_though_noise_makes_them_larger() -> None:
    found = peaks(sides(WAVES))
    value, low, high = np.moveaxis(found[0], -1, 0)
    assert value.mean() > 2.0 + 0.5 * NOISE
    assert ((low <= 2.0) & (high >= 2.0)).mean() > 0.9
    assert (high - low).mean() < 6 * NOISE
    np.testing.assert_allclose(found[1, ..., 1:].mean(axis=(0, 1)), [1.8, 2.2], atol=0.03)


@pytest.mark.parametrize("offset", [3.0, -3.0])
def test_intervals_of_peaks_are_of_frames_that_were_seen(offset: float) -> None:
    """Units that stay on one side of where they rest have no extreme at zero, nor where unseen."""
    whole = sides(WAVES + offset)
    middle = np.abs(whole.measured[10] - offset) < 0.5
    missed = whole._replace(measured=whole.measured.copy(), sigma=whole.sigma.copy())
    missed.measured[10], missed.sigma[10] = np.nan, np.nan
    for seen in (whole, missed):
        low, high = np.moveaxis(peaks(seen)[0], -1, 0)[1:]
        np.testing.assert_allclose((high - low)[middle], 2 * 1.96 * NOISE * np.sqrt(2), rtol=1e-4)


def test_a_departure_is_that_from_the_other_motion() -> None:
    intact = WAVES
    of, sizes = partial(root_mean_square, spacing=15.0), square_sizes(intact, 15.0)
    known = Quantity(of, np.arange(0, UNITS, 2), intact, sizes)
    found = curve(sides(1.1 * WAVES, noise=1e-4, gain=1.2), known)
    size = root_mean_square(intact[:, ::2], 15.0)
    exact = 0.1 * size / size.max()
    np.testing.assert_allclose(found[0, :, 0], exact, atol=1e-3)
    np.testing.assert_allclose(found[1, :, 0], 2 * exact, atol=1e-9)
    assert (found[0, :, 1] <= found[0, :, 0]).all()
    assert (found[0, :, 0] <= found[0, :, 2]).all()
    assert (found[1, :, 1] < exact).all()


def test_a_departure_is_over_the_size_of_the_units_seen() -> None:
    """Lose units that move more than others: those left depart by the same share."""
    intact = np.where(np.arange(UNITS)[:, None] % 4, 1.0, 9.0) * WAVES
    of, still = partial(root_mean_square, spacing=15.0), intact[-1:]
    known = Quantity(of, np.arange(UNITS), intact, square_sizes(still, 15.0))
    for lost in (np.s_[:0], np.s_[::4]):
        seen = sides(1.1 * intact, noise=1e-5)
        seen.measured[10:20, lost] = np.nan
        left = np.delete(intact, lost, axis=1)
        exact = np.full(FRAMES, np.nan)
        exact[:] = 0.1 * of(intact) / of(still)
        exact[10:20] = 0.1 * of(left)[10:20] / of(left[-1])
        found = curve(seen, known)
        np.testing.assert_allclose(found[0, :, 0], exact, rtol=1e-3)
        np.testing.assert_allclose(found[0, :, 1:].mean(axis=1), exact, rtol=0.1)


@pytest.mark.parametrize("size", [0.0, 0.01, 0.1, 1.0])
def test_intervals_of_magnitudes_near_the_noise_hold_the_truth(size: float) -> None:
    """Noise makes magnitudes larger, which their intervals leave out."""
    for quantity in (mean_rotation, mean_displacement):
        every = Quantity(quantity, np.arange(UNITS), sampled=False)
        found = curve(sides(size * WAVES), every)
        truth = quantity(size * WAVES)
        _, low, high = found[0].T
        assert ((low <= truth) & (truth <= high)).mean() > 0.9
        assert (high - low).mean() < 1.5 * NOISE


def test_units_that_stand_for_no_others_are_not_drawn() -> None:
    """Then the interval is that of the noise alone: here of the means of two rows."""
    rows = np.arange(10)
    apart = Quantity(partial(mean_approach, lower=5), rows, sampled=False, signed=True)
    found = curve(sides(WAVES), apart)
    exact = WAVES[:, :5, 1].mean(axis=1) - WAVES[:, 5:10, 1].mean(axis=1)
    np.testing.assert_allclose(found[1, :, 0], exact, atol=1e-12)
    wide = (found[0, :, 2] - found[0, :, 1]).mean()
    np.testing.assert_allclose(wide, 2 * 1.96 * NOISE * np.sqrt(2 / 5), rtol=0.1)
    drawn = curve(sides(WAVES), Quantity(mean_rotation, rows))
    assert (drawn[0, :, 2] - drawn[0, :, 1]).mean() > 0.1


def test_copies_that_are_off_as_a_whole_leave_the_band_as_a_whole() -> None:
    seen = sides(WAVES)
    together = curves.expected_coverage(seen.copies, seen.within(seen.copies), 0.99)
    assert (together < 0.01).all()
    apart = np.random.default_rng(1).standard_normal(seen.copies.shape)
    found = curves.expected_coverage(apart, seen.within(apart), seen.level)
    np.testing.assert_allclose(found, 0.95, atol=0.03)


@pytest.mark.parametrize("shape", [(0, 7, 5), (7, 0)], ids=["no copies", "no units"])
def test_nothing_has_no_size(shape: tuple[int, ...]) -> None:
    found = largest_size(np.ones((2, shape[-1])), np.ones(shape, dtype=bool))
    np.testing.assert_array_equal(found, np.full(shape[:-1], np.nan))
