"""Standard uncertainties that hold: from the image, scaled by what the motions themselves show.

A codec moves whole units by errors that leave no trace in a frame's residuals. But it moves each by
its own, while the specimen moves in a few shapes that neighbours share. What is left of the motions
without these shapes (singular vectors that are smooth over the specimen) is noise, and tells by how
much the image's own figure is too small: frame by frame, and unit by unit. A codec also shows whole
frames a little before or after their time; the shapes' amplitudes, which go on smoothly, tell this.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.tracking.arrays import Floats, Ints, Mask

_PARAMETERS = 7
_MOST_FRAMES = 400
_MOST_SHAPES = 30
_SMOOTH = 0.75
"""Correlation of neighbours in a singular vector that is a shape of motion."""
_OUTLIER = 25.0
_PRIOR = 10.0
"""Weight, in samples, of the belief that a unit or frame is as all others are."""
_LEAST_FREEDOM = 0.2
_FILLINGS = 12
_DIFFERENCES = tuple(
    np.array(row, float) for row in ([1, -2, 1], [1, -4, 6, -4, 1], [1, -6, 15, -20, 15, -6, 1])
)
_LITTLE_MORE = 1.3
_OWN = 0.3
_JOLT = 3.0


def standard_errors(scatter: Floats, blocks: Floats) -> Floats:
    """Standard deviations (..., 3) from the covariance of blocks, corrected for what was fitted."""
    freedom = blocks / np.maximum(blocks - _PARAMETERS, 1)
    variance = np.einsum("...ii->...i", scatter) * freedom[..., None]
    return np.sqrt(variance)


def calibrated(motion: Floats, sigma: Floats, centre: Floats, steady: Mask) -> Floats:
    """The standard uncertainties, scaled so that they tell the scatter of the motions.

    Args:
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) their uncertainties by the image.
        centre: (units, 2) places at rest.
        steady: (frames,) which follow the frame before at the usual distance in time.

    Returns:
        (frames, units, 3); the image's own where there are too few frames to tell.
    """
    if len(motion) < 8:
        return sigma
    near = cKDTree(centre).query(centre, k=min(4, len(centre)))[1][:, 1:]
    out = np.empty_like(motion)
    for dof in range(motion.shape[2]):  # one after the other: recordings may be long
        calm = _calmed(sigma[..., dof].astype(float))
        out[..., dof] = calm * _factor(motion[..., dof], calm, near, steady)
    return out


def _calmed(sigma: Floats) -> Floats:
    """The image's figures, each drawn near to what is usual for its frame and its unit.

    A figure comes from some tens of blocks and scatters by a fifth, most of which says nothing.
    """
    told = np.log(sigma)
    frame = np.nanmedian(told, axis=1, keepdims=True)
    unit = np.nanmedian(told - frame, axis=0, keepdims=True)
    return np.exp(frame + unit + _OWN * (told - frame - unit))


def _factor(motion: Floats, sigma: Floats, near: Ints, steady: Mask) -> Floats:
    """By how much (frames, units) the uncertainties of one degree of freedom are too small."""
    chunk = slice(None) if len(motion) <= _MOST_FRAMES else slice(_MOST_FRAMES)
    seen = motion[chunk]
    known = np.isfinite(seen)
    amplitude, shape, rest = _shapes(seen, near)
    freedom = (1 - _leverage(amplitude))[:, None] * (1 - _leverage(shape.T))
    jitter = _rough(amplitude, steady[chunk]) @ shape
    spread = rest**2 / np.maximum(freedom, _LEAST_FREEDOM) + jitter**2
    ratio = np.where(known & (freedom > _LEAST_FREEDOM), spread / sigma[chunk] ** 2, np.nan)
    usual = np.nanmedian(ratio) / 0.455
    ratio = np.minimum(ratio, _OUTLIER * usual)
    level = float(np.nanmean(ratio))
    by_frame = _shrunk(ratio, level, 1)
    by_unit = _shrunk(ratio / by_frame[:, None], 1.0, 0)
    frames = np.append(by_frame, np.full(len(motion) - len(by_frame), level))
    return np.sqrt(frames[:, None] * by_unit[None, :])


def _shrunk(ratio: Floats, level: float, axis: int) -> Floats:
    count = np.isfinite(ratio).sum(axis=axis)
    return (np.nansum(ratio, axis=axis) + _PRIOR * level) / (count + _PRIOR)


def _shapes(motion: Floats, near: Ints) -> tuple[Floats, Floats, Floats]:
    """Amplitudes (frames, n) and shapes (n, units) that neighbours share, and what is left.

    What is missing is filled in time first, then by the shapes themselves, until it stays.
    """
    known = np.isfinite(motion)
    full = _filled(motion)
    for _ in range(1 if known.all() else _FILLINGS):
        left, values, right = np.linalg.svd(full, full_matrices=False)
        alike = [abs(_likeness(one, near)) > _SMOOTH for one in right[: _most(full)]]
        count = alike.index(False) if False in alike else len(alike)
        amplitude, shape = left[:, :count] * values[:count], right[:count]
        low = amplitude @ shape
        full = np.where(known, motion, low)
    return amplitude, shape, full - low


def _most(motion: Floats) -> int:
    return min(_MOST_SHAPES, min(motion.shape) // 2)


def _filled(motion: Floats) -> Floats:
    """Missing values by those before and after, in time."""
    out = motion.copy()
    frames = np.arange(len(motion))
    for unit in np.nonzero(~np.isfinite(motion).all(axis=0))[0]:
        known = np.isfinite(motion[:, unit])
        out[:, unit] = np.interp(frames, frames[known], motion[known, unit]) if known.any() else 0.0
    return out


def _leverage(columns: Floats) -> Floats:
    """Share (n,) of each row's freedom that a fit of the columns takes."""
    return np.sum(np.linalg.qr(columns)[0] ** 2, axis=1)


def _rough(amplitude: Floats, steady: Mask) -> Floats:
    """What amplitudes (frames, n) are off polynomials through those beside, in one frame's noise.

    The order is the lowest that leaves little more than the next ones: more is motion. A jolt is
    motion too, so values are held to a few times the usual; frames at the ends are as the next.
    """
    rough = [_differences(amplitude, steady, weights) for weights in _DIFFERENCES]
    usual = np.array([np.nanmedian(np.abs(one), axis=0) / 0.6745 for one in rough])
    usual = np.nan_to_num(usual)
    out = np.empty_like(amplitude)
    for column in range(amplitude.shape[1]):
        order = int(np.argmax(usual[:, column] <= _LITTLE_MORE * usual[:, column].min()))
        values, most = rough[order][:, column], _JOLT * usual[order, column]
        known = np.nonzero(np.isfinite(values))[0]
        if len(known):
            values = np.interp(np.arange(len(values)), known, values[known])
        out[:, column] = np.clip(np.nan_to_num(values), -most, most)
    return out


def _differences(amplitude: Floats, steady: Mask, weights: Floats) -> Floats:
    out = np.full_like(amplitude, np.nan)
    reach = len(weights) // 2
    for frame in range(reach, len(amplitude) - reach):
        if steady[frame - reach + 1 : frame + reach + 1].all():
            out[frame] = weights @ amplitude[frame - reach : frame + reach + 1]
    return out / np.linalg.norm(weights)


def _likeness(shape: Floats, near: Ints) -> float:
    """Correlation of a field over the units with the mean of the nearest ones."""
    around = shape[near].mean(axis=1)
    scale = np.sqrt((shape @ shape) * (around @ around))
    return float(shape @ around / scale) if scale > 0 else 0.0
