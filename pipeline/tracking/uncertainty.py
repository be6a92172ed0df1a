"""Standard uncertainties that hold: from the image, scaled by what the motions themselves show.

A codec moves whole units by errors that leave no trace in a frame's residuals. But it moves each by
its own, while the specimen moves in a few shapes that neighbours share. What is left of the motions
without these shapes (singular vectors that are smooth over the specimen) is noise, and tells by how
much the image's own figure is too small: frame by frame, and unit by unit.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.tracking.arrays import Floats, Ints

_PARAMETERS = 7
_MOST_FRAMES = 400
_MOST_SHAPES = 30
_SMOOTH = 0.75
"""Correlation of neighbours in a singular vector that is a shape of motion."""
_OUTLIER = 25.0
_PRIOR = 10.0
"""Weight, in samples, of the belief that a unit or frame is as all others are."""
_LEAST_FREEDOM = 0.2


def standard_errors(scatter: Floats, blocks: Floats) -> Floats:
    """Standard deviations (..., 3) from the covariance of blocks, corrected for what was fitted."""
    freedom = blocks / np.maximum(blocks - _PARAMETERS, 1)
    variance = np.einsum("...ii->...i", scatter) * freedom[..., None]
    return np.sqrt(variance)


def calibrated(motion: Floats, sigma: Floats, centre: Floats) -> Floats:
    """The standard uncertainties, scaled so that they tell the scatter of the motions.

    Args:
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) their uncertainties by the image.
        centre: (units, 2) places at rest.

    Returns:
        (frames, units, 3); the image's own where there are too few frames to tell.
    """
    if len(motion) < 8:
        return sigma
    near = cKDTree(centre).query(centre, k=min(7, len(centre)))[1][:, 1:]
    factors = [_factor(motion[..., dof], sigma[..., dof], near) for dof in range(3)]
    return sigma * np.stack(factors, axis=-1)


def _factor(motion: Floats, sigma: Floats, near: Ints) -> Floats:
    """By how much (frames, units) the uncertainties of one degree of freedom are too small."""
    every = max(1, -(-len(motion) // _MOST_FRAMES))
    seen = motion[::every]
    known = np.isfinite(seen)
    rest, freedom = _without_shapes(_filled(seen), near)
    ratio = (
        np.where(known & (freedom > _LEAST_FREEDOM), rest**2 / freedom, np.nan)
        / sigma[::every] ** 2
    )
    usual = np.nanmedian(ratio) / 0.455
    ratio = np.minimum(ratio, _OUTLIER * usual)
    level = float(np.nanmean(ratio))
    by_frame = _shrunk(ratio, level, 1)
    by_unit = _shrunk(ratio / by_frame[:, None], 1.0, 0)
    places = np.minimum(np.arange(len(motion)) // every, len(by_frame) - 1)
    return np.sqrt(by_frame[places, None] * by_unit[None, :])


def _shrunk(ratio: Floats, level: float, axis: int) -> Floats:
    count = np.isfinite(ratio).sum(axis=axis)
    return (np.nansum(ratio, axis=axis) + _PRIOR * level) / (count + _PRIOR)


def _filled(motion: Floats) -> Floats:
    """Missing values by those before and after, in time."""
    out = motion.copy()
    frames = np.arange(len(motion))
    for unit in np.nonzero(~np.isfinite(motion).all(axis=0))[0]:
        known = np.isfinite(motion[:, unit])
        out[:, unit] = np.interp(frames, frames[known], motion[known, unit]) if known.any() else 0.0
    return out


def _without_shapes(motion: Floats, near: Ints) -> tuple[Floats, Floats]:
    """The motions without the shapes that neighbours share, and the share of noise that is left."""
    left, values, right = np.linalg.svd(motion, full_matrices=False)
    count = 0
    for shape in right[: min(_MOST_SHAPES, len(values) // 2)]:
        if abs(_likeness(shape, near)) < _SMOOTH:
            break
        count += 1
    low = (left[:, :count] * values[:count]) @ right[:count]
    frame = 1 - (left[:, :count] ** 2).sum(axis=1)
    unit = 1 - (right[:count] ** 2).sum(axis=0)
    return motion - low, frame[:, None] * unit[None, :]


def _likeness(shape: Floats, near: Ints) -> float:
    """Correlation of a field over the units with the mean of the nearest ones."""
    around = shape[near].mean(axis=1)
    scale = np.sqrt((shape @ shape) * (around @ around))
    return float(shape @ around / scale) if scale > 0 else 0.0
