"""Predicts a curve with the band that holds 95 % of new curves as a whole."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from pipeline.calibration.inputs import Sampling
from pipeline.calibration.population.curve_emulator import CurveEmulator, log_force
from pipeline.calibration.population.hierarchical_model import (
    Draws,
    PriorNumbers,
    Readings,
    correlation,
    sample_posteriors,
)
from sim.core import Floats

LEVEL = 0.95
REPEATS = 64
"""New samples for every draw from the posterior."""
NEW_CURVES = 100
"""For every simulated set of samples."""
_REACH = np.linspace(-5.0, 5.0, 201)
"""Sums the law of a spread at these, in standard deviations of its prior."""
_JITTER = 1e-10


class PredictionBand(NamedTuple):
    """Holds the logarithms of forces (n,): median, and ends between which 95 % of curves lie.

    The ends are so far from the median, in units of the pointwise spread, that 95 % of all curves
    lie between them over their whole length: points of a curve go together, so curves count.
    """

    median: Floats
    low: Floats
    high: Floats

    @property
    def half_width(self) -> float:
        """Averages half the distance of the ends."""
        return float((self.high - self.low).mean() / 2)

    def holds(self, log_force: Floats) -> Floats:
        """Tests whether each curve (..., n) lies inside as a whole."""
        return np.asarray(((log_force >= self.low) & (log_force <= self.high)).all(axis=-1))


class PosedCurve(NamedTuple):
    """Holds where a curve is to be predicted, and its emulator there."""

    displacement: Floats  # (n,) mm
    place: Floats  # (n,) over the largest one
    weights: Floats  # (n, ...) of the emulator
    ratios: Floats  # (2,) its centre
    kind: int  # number of its kind of test among those fitted

    def predict(self, logs: Floats) -> Floats:
        """Predicts (..., n) logarithms of forces at the constants (..., 3)."""
        base = np.log(self.displacement)
        return np.asarray(log_force(self.weights, self.ratios, base, logs))


def pose_curve(emulator: CurveEmulator, displacement: Floats, kind: int) -> PosedCurve:
    """Poses a curve at displacements in mm."""
    place = displacement / emulator.displacement[-1]
    return PosedCurve(displacement, place, emulator.weights(displacement), emulator.centre, kind)


def redraw_population(
    draws: Draws, priors: PriorNumbers, random: np.random.Generator, repeats: int = REPEATS
) -> Draws:
    """Draws mean and spread anew, by their exact law given the samples' constants.

    Readings tell of the population through its samples alone. With n of them, of mean m and sum of
    squares q about it, and the prior N(c, w^2) of the mean,

        p(ln s | m, q) ~ p(ln s) s^(1 - n) exp(-q / 2 s^2) N(m; c, w^2 + s^2 / n),

    and the mean is normal given s. The walk of a sampler through the long tail of s would leave
    far more noise in the ends of a band.

    Args:
        draws: from one posterior, each (n_draws, ...).
        priors: of it.
        random: where they are drawn from.
        repeats: for every draw.

    Returns:
        (n_draws * repeats, ...) draws from the same posterior.
    """
    constants = np.moveaxis(draws["constants"], 1, 2)  # (n_draws, 3, n_samples)
    count, middle = constants.shape[-1], constants.mean(axis=-1, keepdims=True)
    square = count * constants.var(axis=-1, keepdims=True)
    centre, width = np.reshape(priors.centre, (3, 1)), np.square(priors.constants)

    logs = priors.medians[0] + priors.wide * _REACH
    of_mean = width + np.exp(2 * logs) / count
    weight = -(_REACH**2) / 2 + (1 - count) * logs - square * np.exp(-2 * logs) / 2
    weight = weight - np.log(of_mean) / 2 - (middle - centre) ** 2 / (2 * of_mean)
    below = np.cumsum(np.exp(weight - weight.max(axis=-1, keepdims=True)), axis=-1)
    at = below[..., -1:] * random.uniform(size=(*middle.shape[:2], repeats))
    place = np.minimum((at[..., None, :] > below[..., None]).sum(axis=-2), len(_REACH) - 1)
    within = (logs[1] - logs[0]) * random.uniform(-0.5, 0.5, size=place.shape)
    spread = np.exp(logs[place] + within)

    known = width / (width + spread**2 / count)
    mean = centre + known * (middle - centre)
    mean = mean + np.sqrt(known / count) * spread * random.normal(size=spread.shape)
    made = {"mean": mean, "spread": spread}
    flat = {name: np.moveaxis(each, 2, 1).reshape(-1, 3) for name, each in made.items()}
    return {name: np.repeat(draws[name], repeats, axis=0) for name in _POSTERIOR_NAMES} | flat


def new_curves(
    curve: PosedCurve,
    draws: Draws,
    random: np.random.Generator,
    *,
    sample: int | None = None,
    repeats: int = 1,
) -> Floats:
    """Draws curves of a new sample, or of a known one, as they would be read.

    Args:
        curve: the curve.
        draws: from one posterior, each (n, ...).
        random: where the rest is drawn from.
        sample: a sample of the fit, in place of a new one.
        repeats: curves for every draw.

    Returns:
        (n * repeats, n_points) logarithms of forces.
    """
    repeated = {name: np.repeat(draws[name], repeats, axis=0) for name in _POSTERIOR_NAMES}
    logs = repeated["mean"] + repeated["spread"] * random.normal(size=repeated["mean"].shape)
    if sample is not None:
        logs = repeated["constants"][:, sample]
    root = np.linalg.cholesky(correlation(curve.place) + _JITTER * np.eye(len(curve.place)))
    count = len(logs)
    missed, mounted, read = random.normal(size=(3, count, len(curve.place)))
    scale = repeated["discrepancy"][:, None], repeated["mounting"], repeated["reading"]
    common = scale[0] * (missed @ root.T) + scale[1][:, [curve.kind]] * (mounted @ root.T)
    return np.asarray(curve.predict(logs) + common + scale[2][:, [curve.kind]] * read)


_POSTERIOR_NAMES = ("mean", "spread", "constants", "discrepancy", "mounting", "reading")


def find_band(curves: Floats) -> PredictionBand:
    """Finds the band of drawn curves (n, n_points)."""
    below, median, above = np.quantile(curves, [0.16, 0.5, 0.84], axis=0)
    unit = (above - below) / 2
    reach = np.quantile((np.abs(curves - median) / unit).max(axis=1), LEVEL)
    return PredictionBand(median, median - reach * unit, median + reach * unit)


def student_band(curve: PosedCurve, constants: Floats) -> PredictionBand:
    """Finds Student's interval of a new sample from so many samples' own predictions.

    Args:
        curve: the curve.
        constants: (n_samples, 3) logarithms.
    """
    each = curve.predict(constants)
    count = len(each)
    quantile = stdtrit(count - 1, (1 + LEVEL) / 2) * np.sqrt(1 + 1 / count)
    middle, reach = each.mean(axis=0), quantile * each.std(axis=0, ddof=1)
    return PredictionBand(middle, middle - reach, middle + reach)


def medians(draws: Draws) -> Mapping[str, Floats]:
    """Takes medians over the draws of one posterior."""
    return {name: np.median(draws[name], axis=0) for name in _POSTERIOR_NAMES}


class Coverage(NamedTuple):
    """Holds of every simulated set (n_sets,) the part of new curves inside, and relative widths."""

    inside: Floats  # part of the new curves that lie inside as a whole
    width: Floats  # of the band, over that of Student's interval of the same samples


def simulate_coverage(
    readings: Readings,
    priors: PriorNumbers,
    curve: PosedCurve,
    truth: Mapping[str, Floats],
    effort: Sampling,
    seed: int = 1,
) -> Coverage:
    """Simulates sets of samples from a known population, and fits each as if it were measured.

    Args:
        readings: the design: which samples are read in which test, and where.
        priors: of the fit.
        curve: that is predicted.
        truth: mean, spread (3,), discrepancy (), mounting and reading (n_kinds,).
        effort: how many sets, and how long each is sampled.
        seed: of all.
    """
    random, n_sets = np.random.default_rng(seed), effort.simulated_sets
    n_samples = readings.shares.shape[-1]
    logs = truth["mean"] + truth["spread"] * random.normal(size=(n_sets, n_samples, 3))
    scales = (truth["discrepancy"], truth["mounting"], truth["reading"])
    roots = np.linalg.cholesky(readings.covariance(*scales))
    noise = np.einsum("tnm,stm->stn", roots, random.normal(size=(n_sets, *readings.used.shape)))
    made = np.array([readings.expected(each) for each in logs]) + noise
    alike = np.broadcast_to
    found = sample_posteriors(
        readings._replace(log_force=made, used=alike(readings.used, made.shape)),
        PriorNumbers(*(alike(each, (n_sets, *np.shape(each))) for each in priors)),
        warm_up=effort.simulated_draws,
        draws=effort.simulated_draws,
        seed=seed,
    )
    same = {name: np.asarray(value)[None] for name, value in truth.items()}
    new = new_curves(curve, same | {"constants": logs[:1]}, random, repeats=NEW_CURVES * n_sets)
    inside, width = np.empty(n_sets), np.empty(n_sets)
    for k, curves in enumerate(new.reshape(n_sets, NEW_CURVES, -1)):
        draws = {name: values[k] for name, values in found.items()}
        known = redraw_population(draws, priors, random)
        band = find_band(new_curves(curve, known, random))
        inside[k] = band.holds(curves).mean()
        width[k] = band.half_width / student_band(curve, medians(draws)["constants"]).half_width
    return Coverage(inside, width)
