"""Measures the distance of a simulation from a measurement, with intervals.

The intervals are those of a bootstrap over units and over blocks of frames (Kuensch, Ann. Stat. 17
(1989) 1217). To every copy noise of the measurement's own uncertainty is added, and its mean square
is taken out again, so that the interval holds it and the value is not shifted by it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints

COPIES = 300
LEVEL = 0.95
METRICS = ("rmse", "nrmse", "correlation", "noise_share", "time_shift")

_LEAST_BLOCKS = 4  # blocks in a recording, at least
_STEPS = 6


class Pair(NamedTuple):
    """Holds both sides of a comparison, NaN in either where there is nothing to compare."""

    measured: Floats  # (frames, units, dofs)
    simulated: Floats  # likewise
    sigma: Floats  # standard uncertainty of the measured ones
    slope: Floats | None = None  # (frames, units, dofs) rate of the simulated, per s
    added: bool = False  # whether noise of that uncertainty was added once more

    def resample(self, frames: Ints, units: Ints) -> "Pair":
        """Selects frames and units by number, which may come more than once."""
        chosen = np.ix_(frames, units)
        slope = None if self.slope is None else self.slope[chosen]
        return Pair(self.measured[chosen], self.simulated[chosen], self.sigma[chosen], slope)

    def with_noise(self, random: np.random.Generator) -> "Pair":
        """Adds noise to the measured side."""
        noise = random.standard_normal(self.measured.shape) * np.nan_to_num(self.sigma)
        return self._replace(measured=self.measured + noise, added=True)


class _Moments(NamedTuple):
    """Holds means (dofs,) over frames and units of what the metrics are made of."""

    residual: Floats
    measured: Floats
    variance: Floats
    noise: Floats
    correlation: Floats


def compute_metrics(pair: Pair) -> Floats:
    """Computes metrics (len(METRICS), dofs) of both sides; NaN where nothing can be compared."""
    mean = _moments(pair)
    with np.errstate(invalid="ignore", divide="ignore"):
        rows = [
            np.sqrt(mean.residual),
            np.sqrt(mean.residual / mean.measured),
            mean.correlation,
            mean.noise / mean.residual,
            _time_shift(pair),
        ]
    return np.where(np.isfinite(rows), rows, np.nan)


def _moments(pair: Pair) -> _Moments:
    known = np.isfinite(pair.measured - pair.simulated)
    count = np.count_nonzero(known, axis=(0, 1))

    def mean(*factors: Floats) -> Floats:
        return _sum(*factors) / count

    sigma = np.where(known, np.nan_to_num(pair.sigma), 0.0)
    measured, simulated = (np.where(known, side, 0.0) for side in (pair.measured, pair.simulated))
    apart = measured - simulated
    with np.errstate(invalid="ignore", divide="ignore"):
        noise = mean(sigma, sigma)
        extra = noise if pair.added else np.zeros_like(noise)
        first, last, square = mean(measured), mean(simulated), mean(measured, measured)
        variance = np.maximum(square - first**2 - extra, 0.0)
        spread = mean(simulated, simulated) - last**2
        product = mean(measured, simulated) - first * last
        correlation = product / np.sqrt(variance * spread)
        residual = np.maximum(mean(apart, apart) - extra, 0.0)
    return _Moments(residual, square - extra, variance, noise, correlation)


def _sum(*factors: Floats) -> Floats:
    """Sums the product of one or two fields (frames, units, dofs) over frames and units."""
    return np.asarray(np.einsum(f"{','.join(['fud'] * len(factors))}->d", *factors))


def _time_shift(pair: Pair) -> Floats:
    """Computes the delay (dofs,) of the measured side, s, to first order in it."""
    if pair.slope is None:
        return np.full(pair.measured.shape[-1], np.nan)
    apart = pair.measured - pair.simulated
    known = np.isfinite(apart) & np.isfinite(pair.slope)
    slope = np.where(known, pair.slope, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return -_sum(np.where(known, apart, 0.0), slope) / _sum(slope, slope)


def align_in_time(pair: Pair, time: Floats) -> tuple[Pair, Floats]:
    """Delays the simulated side as much as the measured one, and tells by how much (dofs,), s.

    `time` (frames,) is in s. The shift is NaN where the sides are so unlike that none is found.
    """
    most = float(np.ptp(time)) / _LEAST_BLOCKS
    total = np.zeros(pair.measured.shape[-1])
    moved = _delay(pair, time, total)
    for _ in range(_STEPS):
        total = np.clip(total + np.nan_to_num(_time_shift(moved)), -most, most)
        moved = _delay(pair, time, total)
    return moved, np.where(np.abs(total) < most, total, np.nan)


def _delay(pair: Pair, time: Floats, lag: Floats) -> Pair:
    """Delays the simulated side by ``lag`` (dofs,) s; NaN where that is not known."""
    made = np.full_like(pair.simulated, np.nan)
    for dof, late in enumerate(lag):
        for unit in range(made.shape[1]):
            course = pair.simulated[:, unit, dof]
            known = np.isfinite(course)
            if known.any():
                made[:, unit, dof] = np.interp(
                    time - late, time[known], course[known], left=np.nan, right=np.nan
                )
    return pair._replace(simulated=made, slope=np.gradient(made, time, axis=0))


def estimate_metrics(pair: Pair, time: Floats | None, random: np.random.Generator) -> Floats:
    """Computes value and ends of the interval (3, len(METRICS), dofs) of every metric.

    `time` (frames,) is in s; a quasi-static pair has none, and no shift in time.
    """
    found = bootstrap(pair, compute_metrics, random)
    if time is None:
        return found
    late, total = align_in_time(pair, time)
    shift = bootstrap(late, lambda copy: _time_shift(copy)[None], random)[:, 0]
    found[:, METRICS.index("time_shift")] = total + shift - shift[0]
    return found


def bootstrap(
    pair: Pair, statistic: Callable[[Pair], Floats], random: np.random.Generator
) -> Floats:
    """Computes a statistic's value and the ends of its interval, stacked (3, ...)."""
    frames, units = pair.measured.shape[:2]
    length = block_length(pair.measured - pair.simulated)

    def copy() -> Pair:
        drawn = np.asarray(random.integers(units, size=units))
        return pair.resample(_blocks(frames, length, random), drawn).with_noise(random)

    copies = [statistic(copy()) for _ in range(COPIES)]
    return np.concatenate([statistic(pair)[None], interval_ends(np.array(copies))])


def interval_ends(copies: Floats) -> Floats:
    """Computes the ends (2, ...) of the interval of most copies (n, ...); NaN for none."""
    ends = np.full((2, *copies.shape[1:]), np.nan)
    known = np.isfinite(copies).all(axis=0)
    tail = (1 - LEVEL) / 2
    ends[:, known] = np.quantile(copies[:, known], [tail, 1 - tail], axis=0)
    return ends


def block_length(residual: Floats) -> int:
    """Computes a block's frames: until residuals (frames, ...) forget, at most a quarter."""
    flat = np.nan_to_num(residual.reshape(len(residual), -1))
    most = max(len(flat) // _LEAST_BLOCKS, 1)
    size = float(np.sum(flat**2))
    for lag in range(1, most):
        if float(np.sum(flat[lag:] * flat[:-lag])) < size / np.e:
            return lag
    return most


def _blocks(frames: int, length: int, random: np.random.Generator) -> Ints:
    """Draws numbers of as many frames, in blocks that start anywhere and go round the end."""
    count = -(-frames // length)
    starts = random.integers(frames, size=count)
    return ((starts[:, None] + np.arange(length)).ravel()[:frames]) % frames
