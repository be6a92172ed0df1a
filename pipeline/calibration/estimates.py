"""Computes values with intervals from a fit, and warns of what weakens them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit

from pipeline.calibration.experiments import DecayTest
from pipeline.calibration.fit_uncertainty import Uncertainty, invert_information, slopes
from pipeline.calibration.inputs import ConstantName, Constants
from pipeline.calibration.least_squares import Fit
from sim.core import Floats, Ints

DETERMINED, WEAK, UNDETERMINED, AT_BOUND = range(4)
WEAK_FROM, NOTHING_FROM = 0.1, 1.0
"""Standard errors of logarithms from which a constant counts as weakly determined, and as not."""
ILL_CONDITIONED = 30.0
"""Condition number from which constants are hardly told apart."""
CONVERGED = 0.05
MOST_FREQUENCY_RATIO = 1.25
"""Ratio of a trace's frequency to that of the law of its damping, up to which both swing alike."""
_NORMAL_FREEDOM = 1e6
"""Freedom from which Student's distribution is the normal one."""
DERIVED: tuple[ConstantName, ...] = ("damping_translation", "damping_rotation")
"""Constants that follow from a damping ratio by the authors' law."""


class Estimate(NamedTuple):
    """Holds values of the constants, the wanted ones before those that follow from them."""

    names: tuple[ConstantName, ...]  # of the constants
    n_fitted: int  # how many of them were fitted
    value: Floats  # (n,) in working units
    error: Floats  # (n,) standard errors of their logarithms
    bound: Floats  # (n,) of Cramer and Rao, of the standard errors
    low: Floats  # (n,) lower ends of the 95 % intervals
    high: Floats  # (n,) upper ends
    covariance: Floats  # (n, n) of the logarithms
    status: Ints  # (n,) how well each is determined
    # ratio of the longest to the shortest axis of the wanted constants' ellipsoid, each counted in
    # its own standard errors
    condition: float

    @property
    def correlation(self) -> Floats:
        """(n, n) of the logarithms."""
        return self.covariance / np.outer(self.error, self.error)


class Quality(NamedTuple):
    """Measures how well the fit explains each set."""

    points: Ints  # (n_sets,) measured values
    freedom: Floats  # (n_sets,) what the fit leaves of their freedom
    chi_square: Floats  # (n_sets,) sum of squares in units of the stated, or the estimated, noise
    level: Floats  # (n_sets,) estimated factor on the stated noise; 1 where the noise is known
    autocorrelation: Floats  # (n_sets,) of whitened residuals that follow one another in a course


def estimate_constants(fit: Fit, known: Uncertainty) -> Estimate:
    """Computes values with their 95 % intervals, which are symmetric in the logarithm."""
    names = fit.model.names
    follows = DERIVED if "damping_ratio" in names else ()
    every = (*names, *follows)
    logs = fit.unknowns[: len(names)]
    turn = slopes(fit.model.begin, names, logs, lambda each: each.logs(every))
    covariance = turn @ known.covariance @ turn.T
    error, bound = (np.sqrt(np.diag(each)) for each in (covariance, turn @ known.bound @ turn.T))
    here = fit.model.constants(fit.unknowns)
    reach = _quantiles(fit, turn) * error
    low, high = (_values(here, every, here.logs(every) + sign * reach) for sign in (-1, 1))
    values = np.array([here.value(name) for name in every])
    status = np.where(error > WEAK_FROM, WEAK, DETERMINED)
    near = np.abs(fit.unknowns[:, None] - fit.bounds)[: len(names)].min(axis=1) < 1e-3
    status[: len(names)][near] = AT_BOUND
    status[error > NOTHING_FROM] = UNDETERMINED
    scaled = known.covariance / np.outer(error[: len(names)], error[: len(names)])
    axes = np.linalg.eigvalsh(scaled)
    condition = float(np.sqrt(axes[-1] / max(axes[0], 1e-16)))
    return Estimate(
        every, len(names), values, error, bound, low, high, covariance, status, condition
    )


def _values(here: Constants, names: Sequence[ConstantName], logs: Floats) -> Floats:
    """Constants in working units, each from its own logarithm."""
    barrier = np.array(
        [here.law.barrier_angle if name == "contact_cutoff" else 0.0 for name in names]
    )
    return barrier + np.exp(np.minimum(logs, 300.0))


def _quantiles(fit: Fit, turn: Floats) -> Floats:
    """Computes quantiles (n,) of the 95 % intervals: Student's, where noise was estimated.

    `turn` (n, n_names) are the slopes of the values' logarithms by those fitted. A variance is the
    sum of those V_k that the sets leave, each known by its own freedom f_k, and has that of Welch
    and Satterthwaite (1946, Biometrics 2, 110): f = (sum V_k)^2 / sum (V_k^2 / f_k).
    """
    sensitivity = turn @ invert_information(fit.jacobian)[: turn.shape[1]]
    rows, spread = fit.model.set_of_row, (fit.jacobian @ sensitivity.T) ** 2
    variance, freedom_sum = np.zeros((2, len(turn)))
    for k, (each, left) in enumerate(
        zip(fit.model.experiments, _residual_freedom(fit), strict=True)
    ):
        part = spread[rows == k].sum(axis=0)
        variance += part
        freedom_sum += 0.0 if each.measured.known else part**2 / max(left, 1.0)
    informed = variance > 0.0  # by any set
    freedom = np.full_like(variance, _NORMAL_FREEDOM)
    total = np.maximum(freedom_sum, 1e-12 * variance**2)
    freedom[informed] = variance[informed] ** 2 / total[informed]
    return np.where(
        freedom < _NORMAL_FREEDOM, stdtrit(np.maximum(freedom, 1.0), 0.975), ndtri(0.975)
    )


def _residual_freedom(fit: Fit) -> Floats:
    """Computes what the fit leaves of the sets' freedom (n_sets,)."""
    basis = np.linalg.svd(fit.jacobian, full_matrices=False)[0]
    taken, rows = (basis**2).sum(axis=1), fit.model.set_of_row
    means = [each.measured.unbiased for each in fit.model.experiments]
    return np.array([(1 - taken[rows == k]).sum() - mean for k, mean in enumerate(means)])


def measure_quality(fit: Fit) -> Quality:
    """Measures how well the fit explains each set."""
    rows, sets = fit.model.set_of_row, range(len(fit.model.experiments))
    return Quality(
        points=np.array([(rows == k).sum() for k in sets]),
        freedom=_residual_freedom(fit),
        chi_square=np.array([(fit.residual[rows == k] ** 2).sum() for k in sets]),
        level=fit.level,
        autocorrelation=np.array([_autocorrelation(fit.residual[rows == k], fit, k) for k in sets]),
    )


def _autocorrelation(residual: Floats, fit: Fit, k: int) -> float:
    """Computes the correlation of residuals that follow one another in a channel of a set."""
    channel = fit.model.experiments[k].measured.channel
    following = channel[1:] == channel[:-1] if len(channel) else np.ones(len(residual) - 1, bool)
    product = (residual[1:] * residual[:-1])[following].mean()
    return float(product / max((residual**2).mean(), 1e-300))


def list_warnings(fit: Fit, found: Estimate, quality: Quality, newton: float) -> list[str]:
    """Warns of weak constants and of sets that the model misses, a sentence each."""
    words = {
        WEAK: "{name} is weakly determined by these data: its standard error is {error:.0%}",
        UNDETERMINED: "{name} is not determined by these data: leave it out of fit, or measure"
        " what depends on it",
        AT_BOUND: "{name} ran to the end of the range that is looked through (a factor of 30 from"
        " the start): check data and start",
    }
    out = [
        words[status].format(name=name, error=error)
        for name, status, error in zip(found.names, found.status, found.error, strict=True)
        if status != DETERMINED
    ]
    if found.condition > ILL_CONDITIONED:
        n = found.n_fitted
        mutual = np.abs(found.correlation[:n, :n]) - np.eye(n)
        one, other = np.unravel_index(mutual.argmax(), mutual.shape)
        out.append(
            f"{found.names[one]} and {found.names[other]} are hardly told apart (correlation"
            f" {found.correlation[one, other]:+.3f}, condition number {found.condition:.0f})"
        )
    if newton > CONVERGED:
        out.append(
            f"the fit has not settled: by the adjoint's gradient it is {newton:.2g} standard"
            " errors from the least sum of squares"
        )
    return out + [
        line for k in range(len(quality.points)) for line in _set_warnings(fit, quality, k)
    ]


def _set_warnings(fit: Fit, quality: Quality, k: int) -> list[str]:
    measured = fit.model.experiments[k].measured
    out = [f"{measured.name}: {remark}" for remark in measured.remarks]
    excess = quality.chi_square[k] / max(quality.freedom[k], 1.0)
    if measured.known and excess > 1 + 4 * np.sqrt(2 / max(quality.freedom[k], 1.0)):
        out.append(
            f"{measured.name}: residuals are {np.sqrt(excess):.2f} times what the stated noise"
            " explains, so the intervals are too narrow: state no noise, to have it estimated"
        )
    chance = 4 / np.sqrt(quality.points[k])
    if quality.autocorrelation[k] > max(chance, 0.15):
        out.append(
            f"{measured.name}: residuals that follow one another are alike (correlation"
            f" {quality.autocorrelation[k]:.2f}): the model misses something, and the intervals are"
            " too narrow"
        )
    return out + _decay_warnings(fit, k)


def _decay_warnings(fit: Fit, k: int) -> list[str]:
    """Warns of a trace of units that swing otherwise than the law of its damping ratio has it."""
    experiment, here = fit.model.experiments[k], fit.model.constants(fit.unknowns)
    if not isinstance(experiment, DecayTest):
        return []
    ratio, measured = experiment.frequency_ratio(here), experiment.peaks.frequency / (2 * np.pi)
    if 1 / MOST_FREQUENCY_RATIO <= ratio <= MOST_FREQUENCY_RATIO:
        return []
    return [
        f"{experiment.measured.name}: the trace swings at {measured:.3g} Hz, where one unit on one"
        f" ligament of these constants turns at {measured / ratio:.3g} Hz: its damping ratio is not"
        " the one that damping is made of; let both units hang free, and check density, spacing"
        " and bending_stiffness"
    ]
