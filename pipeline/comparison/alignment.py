"""Aligns measurement and simulation in time or load by the drive alone.

A motion in time is aligned by the cross-correlation of the measured and the nominal history of the
driven units, to a fraction of a frame. A quasi-static one has no time: equal displacement of the
driven units is equal load, on the way there and back.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.runtime import UserError
from sim.core import Floats

LEAST_FRAMES = 8
LEAST_CORRELATION = 0.9
MOTION, LOADING, UNLOADING = range(3)

_LEAST_OVERLAP = 0.5  # of the shorter history
_LAGS_PER_FRAME = 2  # lags tried
_REFINEMENTS = 12  # pairs of golden sections
_CORRELATION_MARGIN = 0.1  # of the correlation: lags that a finer look may find to be the best
_VARIANCES = 9.0  # times the variance, what three standard deviations add: a lag as good
_SAME = 1e-4  # of the mean square: histories that differ by less are the same
_END_MARGIN = 0.005  # of the nominal range: still its end
_LEAST_RANGE = 0.05  # of the nominal range: a drive that moves
_OVERSAMPLING = 20  # samples of a path that is inverted, for each of its own
_SPEED_SHARE = 0.1  # of the mean speed: neither way


class Lag(NamedTuple):
    """Holds the lag of the measured history behind the nominal one."""

    value: float  # s
    sigma: float  # its standard uncertainty, from what the fit leaves and how that is correlated, s
    correlation: float  # of both histories
    gain: float  # measured over nominal amplitude
    gain_sigma: float  # likewise
    ambiguous: bool  # whether another lag is as good, as in a steady vibration


@dataclass(frozen=True)
class SampledMotion:
    """Interpolates a motion that rests before its first time: (n,) in s, (n, channels) in mm."""

    time: Floats
    value: Floats

    def at(self, time: Floats) -> Floats:
        """Evaluates (times, channels) a cubic spline through the samples, NaN after the last."""
        out = np.where((time <= self.time[-1])[:, None], self.value[0], np.nan)
        inside = (time > self.time[0]) & (time <= self.time[-1])
        out[inside] = self._spline(time[inside])
        return out

    @cached_property
    def moments(self) -> tuple[Floats, Floats, Floats]:
        """Sums the first 0, 1, ... samples less the mean of all, and their squares.

        These follow the samples less that mean: (n, channels), (n + 1, channels), (n + 1,).
        """
        centred = self.value - self.value.mean(axis=0)
        square = np.sum(centred**2, axis=1)
        total = np.zeros((len(centred) + 1, centred.shape[1]))
        total[1:] = np.cumsum(centred, axis=0)
        return centred, total, np.concatenate([[0.0], np.cumsum(square)])

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.time, self.value)


def find_lag(measured: SampledMotion, nominal: SampledMotion) -> Lag:
    """Finds the lag at which the histories agree best, up to a gain and an offset.

    Raises:
        UserError: too few frames, frames without times, or the histories agree at no lag.
    """
    seen = np.isfinite(measured.value).all(axis=1)
    held = SampledMotion(measured.time[seen], measured.value[seen])
    if len(held.time) < LEAST_FRAMES:
        raise too_few_frames(len(held.time))
    if np.median(np.diff(held.time)) <= 0:
        raise UserError(
            "most frames of the track have the time of the one before",
            key="frame_rate",
            remedy="give the recording the rate at which they were taken, and track it again",
        )
    lag, ambiguous = _search_lag(held, nominal)
    correlation = _correlation(held, nominal, lag)
    if correlation < LEAST_CORRELATION:
        raise UserError(
            "the drive cannot be aligned: the measured motion of the driven units follows that of"
            f" the problem at no time (correlation {correlation:.2f},"
            f" where {LEAST_CORRELATION:g} is wanted)",
            key="case",
            remedy="give the structure and the load case that were filmed, or a window that shows"
            " the drive",
        )
    sigma, gain, gain_sigma = _fit(held, nominal, lag)
    return Lag(lag, sigma, correlation, gain, gain_sigma, ambiguous)


def too_few_frames(frames: int) -> UserError:
    """Explains that a track is too short."""
    return UserError(
        "too few frames show the driven units",
        value=frames,
        remedy=f"give a video, or a window of it, with {LEAST_FRAMES} or more",
    )


def _candidate_lags(measured: SampledMotion, nominal: SampledMotion) -> Floats:
    """Lists lags (s) at which the histories overlap enough."""
    interval = float(np.median(np.diff(measured.time)))
    span, length = np.ptp(measured.time), np.ptp(nominal.time)
    least = _LEAST_OVERLAP * min(span, length)
    first = measured.time[0] + least - nominal.time[-1]
    last = measured.time[-1] - least - nominal.time[0]
    return np.arange(first, last, interval / _LAGS_PER_FRAME)


def _search_lag(measured: SampledMotion, nominal: SampledMotion) -> tuple[float, bool]:
    """Finds the lag, s, and whether others are as good, of which it is the nearest to none.

    As good are those whose residual exceeds that of the best by no more than noise allows.
    """
    tried = _candidate_lags(measured, nominal)
    found = np.array([_correlation(measured, nominal, lag) for lag in tried])
    inner = np.concatenate([[-np.inf], found, [-np.inf]])
    peak = np.flatnonzero((found >= inner[:-2]) & (found >= inner[2:]))
    near = peak[found[peak] > found.max() - _CORRELATION_MARGIN]
    lags = np.array([_refine_peak(measured, nominal, lag) for lag in tried[near]])
    left = np.array([1 - _correlation(measured, nominal, lag) ** 2 for lag in lags])
    residual, _ = _residual(measured, nominal, lags[left.argmin()])
    allowed = left.min() * (1 + _VARIANCES * _variance_inflation(residual) / residual.size)
    good = lags[left <= np.fmax(allowed, left.min() + _SAME)]
    nearest = good[np.argmin(np.abs(good))]
    return float(nearest), bool(np.ptp(good) > np.ptp(tried[:2]))


def _common_samples(
    measured: SampledMotion, nominal: SampledMotion, lag: float
) -> tuple[Floats, Floats]:
    """Samples both histories at the frames where both are known, less their means."""
    there = nominal.at(measured.time - lag)
    both = np.isfinite(there).all(axis=1)
    first, last = measured.value[both], there[both]
    return first - first.mean(axis=0), last - last.mean(axis=0)


def _correlation(measured: SampledMotion, nominal: SampledMotion, lag: float) -> float:
    """Correlates the histories, going through those frames alone in which the nominal one moves."""
    ends = nominal.time[[0, -1]]
    first, n = np.searchsorted(measured.time, lag + ends, side="right")
    if n == 0:
        return 0.0
    centred, total, square = measured.moments
    moved = nominal.at(np.minimum(measured.time[first:n] - lag, ends[1])) - nominal.value[0]
    sums = moved.sum(axis=0)
    spread = np.sum(moved**2) - np.sum(sums**2) / n
    size = np.sqrt(max(spread * (square[n] - np.sum(total[n] ** 2) / n), 0.0))
    product = np.sum(moved * centred[first:n]) - np.sum(sums * total[n]) / n
    return float(product / size) if size > 0 else 0.0


def _refine_peak(measured: SampledMotion, nominal: SampledMotion, lag: float) -> float:
    """Refines the peak of the correlation, by golden section within a frame either way."""
    interval = float(np.median(np.diff(measured.time)))
    low, high = lag - interval / _LAGS_PER_FRAME, lag + interval / _LAGS_PER_FRAME
    share = (np.sqrt(5) - 1) / 2
    for _ in range(2 * _REFINEMENTS):
        left, right = high - share * (high - low), low + share * (high - low)
        if _correlation(measured, nominal, left) > _correlation(measured, nominal, right):
            high = right
        else:
            low = left
    return (low + high) / 2


def _fit(measured: SampledMotion, nominal: SampledMotion, lag: float) -> tuple[float, float, float]:
    """Fits the lag's uncertainty, the gain and its uncertainty, by least squares about the lag."""
    step = 1e-3 * float(np.median(np.diff(measured.time)))
    _, last = _common_samples(measured, nominal, lag)
    sooner, later = (nominal.at(measured.time - lag + shift) for shift in (step, -step))
    residual, gain = _residual(measured, nominal, lag)
    variance = float(np.mean(residual**2)) * _variance_inflation(residual)
    steep = float(np.nansum((gain * (sooner - later) / (2 * step)) ** 2))
    return np.sqrt(variance / steep), gain, np.sqrt(variance / float(np.sum(last**2)))


def _residual(measured: SampledMotion, nominal: SampledMotion, lag: float) -> tuple[Floats, float]:
    """Computes what a gain on the nominal history leaves (frames, channels), and the gain."""
    first, last = _common_samples(measured, nominal, lag)
    gain = float(np.sum(first * last) / np.sum(last**2))
    return first - gain * last, gain


def _variance_inflation(residual: Floats) -> float:
    """Computes the variance inflation by correlated residuals (frames, channels), of AR(1)."""
    size = float(np.sum(residual**2))
    autocorrelation = float(np.sum(residual[1:] * residual[:-1])) / size if size > 0 else 0.0
    autocorrelation = float(np.clip(autocorrelation, 0.0, 0.99))
    return (1 + autocorrelation) / (1 - autocorrelation)


def find_load_time(measured: Floats, nominal: SampledMotion) -> Floats:
    """Finds the nominal time (frames,) of the measured drive's place; NaN beyond its ends.

    Args:
        measured: (frames,) displacement of the driven units along the drive, mm.
        nominal: its history, one channel that only grows.

    Raises:
        UserError: too few frames, a drive that goes to and fro, or one that hardly moves.
    """
    history = nominal.value[:, 0]
    if (np.diff(history) <= 0).any():
        remedy = "compare under a ramp: give the problem a drive of that kind"
        raise UserError("a quasi-static drive to and fro has no load axis", remedy=remedy)
    if (seen := int(np.isfinite(measured).sum())) < LEAST_FRAMES:
        raise too_few_frames(seen)
    span = float(np.ptp(history))
    if (reached := float(np.nanmax(measured) - history[0])) < _LEAST_RANGE * span:
        raise UserError(
            f"the drive cannot be aligned: the driven units move by {reached:.3g} mm along the"
            f" drive's direction, where the problem moves them by {span:.3g} mm",
            remedy="check `turned` and `mirrored` of the recording, and its window",
        )
    margin = _END_MARGIN * span
    inside = (measured >= history[0] - margin) & (measured <= history[-1] + margin)
    dense = np.linspace(nominal.time[0], nominal.time[-1], _OVERSAMPLING * len(history))
    finer = np.maximum.accumulate(nominal.at(dense)[:, 0])
    return np.where(inside, np.interp(measured, finer, dense), np.nan)


def find_branches(measured: Floats) -> NDArray[np.int8]:
    """Classifies load (frames,) as growing or falling; at rest, as before."""
    history = _fill_gaps(measured)
    width = max(len(history) // 40, 1)
    kernel = np.ones(2 * width + 1) / (2 * width + 1)
    speed = np.convolve(np.gradient(np.pad(history, 2 * width, mode="edge")), kernel, mode="same")
    speed = speed[2 * width : 2 * width + len(history)]
    way = np.where(np.abs(speed) < _SPEED_SHARE * np.abs(speed).mean(), 0.0, np.sign(speed))
    last = np.maximum.accumulate(np.where(way != 0, np.arange(len(way)), 0))
    return np.where(way[last] < 0, UNLOADING, LOADING).astype(np.int8)


def _fill_gaps(values: Floats) -> Floats:
    seen = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), seen, values[seen])


def drive_turn(measured: Floats, nominal: Floats) -> float:
    """Computes the direction of a measured drive (frames, 2) less that of the nominal one, rad."""
    both = np.isfinite(measured + nominal).all(axis=1)
    first, last = measured[both], nominal[both]
    across = np.sum(last[:, 0] * first[:, 1] - last[:, 1] * first[:, 0])
    return float(np.arctan2(across, np.sum(first * last)))
