import numpy as np
import pytest

from pipeline.tracking.fit import PoseFits
from pipeline.tracking.motion.light_slopes import LightSlopes

UNITS, NOISE, COUPLING = 200, 2.0, 0.8
GOOD = np.ones(UNITS, bool)


def _fits(random: np.random.Generator, slopes: np.ndarray) -> tuple[PoseFits, np.ndarray]:
    """Poses that err with the slopes they were fitted with, of units at rest."""
    covariance = np.eye(5)
    covariance[0, 3] = covariance[3, 0] = covariance[1, 4] = covariance[4, 1] = COUPLING
    error = NOISE * random.multivariate_normal(np.zeros(5), covariance, UNITS)
    light = np.concatenate([np.ones((UNITS, 1)), np.zeros((UNITS, 1)), slopes + error[:, 3:]], 1)
    white = np.repeat(covariance[None], UNITS, axis=0)
    many = np.full(UNITS, 50.0)
    rest = np.full(UNITS, NOISE), np.ones(UNITS), many, np.zeros(UNITS), many
    return PoseFits(error[:, :3].copy(), light, white.copy(), NOISE**2 * white, *rest), error


def _spread(frames: int, shade: float = 0.0) -> tuple[float, float, float]:
    """Returns the spread of x in the last frame: as fitted, with known slopes, and told."""
    random, known = np.random.default_rng(3), LightSlopes(UNITS, 10)
    for frame in range(frames):
        slopes = np.full((UNITS, 2), shade * (frame == frames - 1))
        fits, error = _fits(random, slopes)
        known.apply(fits, GOOD)
    told = float(np.sqrt(np.mean(fits.scatter[:, 0, 0])))
    fitted, improved = (float(np.sqrt(np.mean(x[:, 0] ** 2))) for x in (error, fits.pose))
    return fitted, improved, told


def test_steady_light_takes_out_what_slopes_put_into_places() -> None:
    fitted, improved, told = _spread(20)
    best = fitted * np.sqrt(1 - COUPLING**2)
    assert improved == pytest.approx(best, rel=0.1)
    assert told == pytest.approx(improved, rel=0.1)


def test_light_that_changes_at_once_biases_no_place() -> None:
    fitted, improved, _ = _spread(20, shade=30.0)
    assert improved == pytest.approx(fitted, rel=1e-9)


def test_units_that_are_lost_change_nothing() -> None:
    random, known = np.random.default_rng(3), LightSlopes(UNITS)
    fits, _ = _fits(random, np.zeros((UNITS, 2)))
    fits.pose[:5] = np.nan
    before = fits.copy()
    known.apply(fits, GOOD & (np.arange(UNITS) >= 5))
    np.testing.assert_array_equal(fits.pose[:5], before.pose[:5])
    assert np.isfinite(fits.pose[5:]).all()
    known.apply(fits, ~GOOD)
