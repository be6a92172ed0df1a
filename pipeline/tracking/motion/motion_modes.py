"""Separates motions into modes: a few shapes over the units, whose amplitudes change in time.

Neighbours share most of them. Those of a structure with rough motions they do not share, but then
these stand far above what noise alone makes up.
"""

from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints, Mask

_MOST = 30
_LEAST_CORRELATION = 0.75
"""Correlation of neighbours in a singular vector that is a shape of motion."""
_SINGULAR_RATIO = 3.0
"""Or how far its singular value is above white noise: a codec's noise drifts, and so stands out."""
_NOISE_THRESHOLD = 2.858
"""Singular value, over the median, of a shape that is told from white noise (Gavish and Donoho,
IEEE Trans. Inf. Theory 60 (2014) 5040)."""
_COMMON_ROUNDS = 8
_IMPUTATIONS, _CONVERGED = 80, 0.1
"""Rounds in which missing motions are filled, at most; a change, over the noise, of no use."""
_HALF_WINDOWS = (1, 2, 3, 4, 5, 6)
"""Frames to either side of one whose place the polynomial through them tells."""
_LEAST_SAMPLES = 4
"""Fewest frames that tell how much a polynomial of higher order leaves."""
_ORDER_TOLERANCE = 1.3
_SINGULAR, _LARGEST_VARIANCE = 1e6, 4.0
"""Condition of what tells no shapes apart; largest variance of an amplitude that is told."""
_OUTLIER = 3.0
_COHERENCE = 3.0
"""Correlation of neighbours' changes that is motion, over its standard deviation by chance."""


class MotionModes(NamedTuple):
    """Holds motions as modes and residuals."""

    amplitude: Floats  # (frames, n)
    shape: Floats  # (n, units)
    residual: Floats  # (frames, units) what is left


def separate_modes(motion: Floats, near: Ints, noise: float) -> MotionModes:
    """Separates the shapes of one degree of freedom.

    What is missing is filled in time first, then by the shapes themselves, until it stays.

    Args:
        motion: (frames, units), NaN where missing.
        near: (units, k) the nearest ones of each.
        noise: standard deviation that the motions have at least.
    """
    known = np.isfinite(motion)
    full = filled(motion)
    for most in [_MOST] if known.all() else np.minimum(range(1, _IMPUTATIONS), _MOST):
        left, values, right = np.linalg.svd(full, full_matrices=False)
        floor = max(_NOISE_THRESHOLD * float(np.median(values)), noise * np.sqrt(full.shape).sum())
        count = _count_modes(values / floor, right[: min(most, len(values) // 2)], near)
        amplitude, shape = left[:, :count] * values[:count], right[:count]
        low = amplitude @ shape
        change = np.sqrt(np.mean((full - low)[~known] ** 2)) if count and not known.all() else 0.0
        full = np.where(known, motion, _impute(full, known, values[:count], shape, noise))
        if change < _CONVERGED * noise and count < most:
            break
    return MotionModes(amplitude, shape, full - low)


def _impute(full: Floats, known: Mask, values: Floats, shape: Floats, noise: float) -> Floats:
    """Imputes motions (frames, units) by shapes (n, units), whose amplitudes the known units tell.

    Amplitudes are as likely large as their singular values (n,) say, and the less certain, the
    nearer to zero.
    """
    prior = np.diag(len(full) * noise**2 / values**2)
    normal = np.einsum("fu,iu,ju->fij", known, shape, shape, optimize=True) + prior
    told = np.linalg.solve(normal, (np.where(known, full, 0.0) @ shape.T)[..., None])[..., 0]
    return np.asarray(told @ shape)


def _count_modes(height: Floats, vectors: Floats, near: Ints) -> int:
    """Counts the first singular vectors that are shapes of motion."""
    for count, (above, vector) in enumerate(zip(height, vectors, strict=False)):
        if (
            above < _SINGULAR_RATIO
            and abs(_neighbour_correlation(vector, near)) < _LEAST_CORRELATION
        ):
            return count
    return len(vectors)


def filled(motion: Floats) -> Floats:
    """Fills missing values by those before and after, in time, about what all units do together."""
    known = np.isfinite(motion)
    if known.all():
        return motion.copy()
    frames, seen = np.arange(len(motion)), known.any(axis=1)
    common = np.zeros(len(motion))
    apart = motion
    # units that are seen now and then are no reason for a common step
    for _ in range(_COMMON_ROUNDS):
        more = np.nansum(apart, axis=1)[seen] / known.sum(axis=1)[seen]
        common += np.interp(frames, frames[seen], more) if seen.any() else 0.0
        apart = motion - common[:, None]
        usual = np.nansum(apart, axis=0) / np.maximum(known.sum(axis=0), 1)
        apart = apart - usual
    apart = motion - common[:, None]
    for unit in np.nonzero(~known.all(axis=0))[0]:
        here = known[:, unit]
        between = np.interp(frames, frames[here], apart[here, unit]) if here.any() else 0.0
        apart[:, unit] = np.where(here, apart[:, unit], between)
    return apart + common[:, None]


def _neighbour_correlation(shape: Floats, near: Ints) -> float:
    """Correlates a field over the units (units, ...) with the mean of the nearest ones."""
    around = shape[near].mean(axis=1)
    scale = np.sqrt(np.vdot(shape, shape) * np.vdot(around, around))
    return float(np.vdot(shape, around) / scale) if scale > 0 else 0.0


def count_at_rest(place: Floats, near: Ints) -> int:
    """Counts the first frames in which neighbours do not move alike.

    A motion too small to be seen of one unit is seen of many: noise, a codec's too, moves each by
    its own.

    Args:
        place: (frames, units, 2), NaN where missing, of frames that look alike.
        near: (units, k) the nearest ones of each.
    """
    shown = np.nan_to_num(place)
    for frame in range(1, len(shown)):
        change = shown[frame] - shown[:frame].mean(axis=0)
        if _neighbour_correlation(change, near) > _COHERENCE / np.sqrt(len(near)):
            return frame
    return len(shown)


def leverage(columns: Floats) -> Floats:
    """Returns the share (n,) of each row's freedom that a fit of the columns takes."""
    return np.sum(np.linalg.qr(columns)[0] ** 2, axis=1)


def constant_share(amplitude: Floats) -> float:
    """Returns the share of a constant that the amplitudes (frames, n) can take up."""
    basis = np.linalg.qr(amplitude)[0]
    return float(np.sum(basis.sum(axis=0) ** 2) / len(basis))


def amplitude_variance(known: Mask, shape: Floats) -> Floats:
    """Returns the variance (frames, n) of the amplitudes that known units (frames, units) tell.

    It is over that of a frame that shows all; NaN where too few do to tell the shapes apart.
    """
    out = np.full((len(known), len(shape)), np.nan)
    for frame, units in enumerate(known):
        normal = shape[:, units] @ shape[:, units].T
        if len(shape) and np.linalg.cond(normal) < _SINGULAR:
            out[frame] = np.diag(np.linalg.inv(normal))
    return np.where(out < _LARGEST_VARIANCE, out, np.nan)


def amplitude_jitter(amplitude: Floats, steady: Mask, time: Floats, variance: Floats) -> Floats:
    """Measures amplitudes (frames, n) against polynomials in time through those beside, per frame.

    The order is the lowest that leaves little more than the next ones: more is motion. Where even
    the last one may be, as the motion is too quick or too short, the jitter is taken to be as
    large. A jolt is motion too, so values are held to a few times the usual; frames at the ends are
    as the next. Values are those of a frame that shows all units, by the amplitudes' variance.
    """
    found = [
        _divided_differences(amplitude, steady, time, reach, variance) for reach in _HALF_WINDOWS
    ]
    usual = np.full((len(found), amplitude.shape[1]), np.inf)
    for order, one in enumerate(found):
        told = np.isfinite(one).sum(axis=0) >= _LEAST_SAMPLES
        usual[order, told] = np.nanmedian(np.abs(one[:, told]), axis=0) / 0.6745
    out = np.zeros_like(amplitude)
    for column in np.flatnonzero(np.isfinite(usual[0])):
        order = int(np.argmax(usual[:, column] <= _ORDER_TOLERANCE * usual[:, column].min()))
        values, most = found[order][:, column], _OUTLIER * usual[order, column]
        known = np.nonzero(np.isfinite(values))[0]
        values = np.interp(np.arange(len(values)), known, values[known])
        out[:, column] = np.clip(values, -most, most)
    return out


def _divided_differences(
    amplitude: Floats, steady: Mask, time: Floats, reach: int, variance: Floats
) -> Floats:
    """Returns divided differences (frames, n) over so many frames to either side.

    Their variance is that of an amplitude whose own is one.
    """
    out = np.full_like(amplitude, np.nan)
    for frame in range(reach, len(amplitude) - reach):
        window = slice(frame - reach, frame + reach + 1)
        if (
            steady[frame - reach + 1 : frame + reach + 1].all()
            and (np.diff(time[window]) > 0).all()
        ):
            apart = time[window, None] - time[None, window] + np.eye(2 * reach + 1)
            weights = 1 / np.prod(apart / np.abs(apart).max(), axis=1)
            out[frame] = weights @ amplitude[window] / np.sqrt(weights**2 @ variance[window])
    return out
