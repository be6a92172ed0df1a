"""Calibrates standard uncertainties of the image by what the motions themselves show.

A codec moves whole units by errors that leave no trace in a frame's residuals. But it moves each by
its own, while the specimen moves in a few shapes. What is left of the motions without these is
noise, and tells by how much the image's own figure is too small: frame by frame, and unit by unit.
A codec also shows whole frames a little before or after their time; the shapes' amplitudes, which
go on smoothly, tell this. What the reference frame's own error adds to all frames alike, shapes
may take up; that frame stands alone in the file, so the image tells it.
"""

import warnings

import numpy as np
from scipy.spatial import cKDTree

from pipeline.tracking.fit import PoseFits
from pipeline.tracking.motion import motion_modes
from sim.core import Floats, Ints, Mask, Reals

_PARAMETERS = 7
_LEAST_FRAMES = 8
_MOST_FRAMES = 400
_OUTLIER_RATIO = 25.0
_CHI_SQUARE = 0.455
"""Median of the square of a normal variable."""
_PRIOR_WEIGHT = 10.0
"""Weight, in samples, of the belief that a unit or frame is as all others are."""
_CODEC_FACTOR = 6.0
"""By how much codecs make variances larger than the image tells, and the weight of this belief in
frames: few frames do not show how their errors drift."""
_CODEC_WEIGHT = 2.0
_FRAME_SHARE = 0.5
"""Least part of the variance by the image that is a frame's own, the rest being the reference's."""
_LEAST_FREEDOM = 0.2
_KEPT_DEVIATION = 0.3
_JITTER = 4.0
"""Variance by which a codec shows frames at other times, at most, over that of its noise; what is
more is a motion too quick, or seen in too few frames, to be followed."""


def standard_errors(scatter: Floats, blocks: Floats) -> Floats:
    """Returns standard errors of poses (..., 3) by the scatter of blocks, corrected for the fit."""
    freedom = blocks / np.maximum(blocks - _PARAMETERS, 1)
    variance = np.einsum("...ii->...i", scatter)[..., :3] * freedom[..., None]
    return np.sqrt(variance)


def median_uncertainty(sigma: Reals) -> tuple[float, float]:
    """Returns medians of uncertainties (frames, units, 3): of a coordinate and of the rotation.

    That of a coordinate is the root mean square of the medians of x and y.
    """
    x, y, turn = np.nanmedian(sigma.astype(float), axis=(0, 1))
    return float(np.hypot(x, y) / np.sqrt(2)), float(turn)


def variance_inflation(fits: PoseFits) -> float:
    """Estimates the variance by correlated residuals over that by white ones: one or more."""
    white = np.einsum("uii->ui", fits.curvature)[:, :3] * fits.noise[:, None] ** 2
    ratio = standard_errors(fits.scatter, fits.blocks) ** 2 / white
    return float(np.nanmedian(ratio)) if np.isfinite(ratio).any() else np.nan


def calibrate_sigma(
    motion: Reals,
    sigma: Reals,
    centre: Floats,
    steady: Mask,
    time: Floats | None = None,
    reference: float = 1.0,
    coded: bool = True,
) -> Reals:
    """Scales the standard uncertainties so that they tell the scatter of the motions.

    Args:
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) their uncertainties by the image.
        centre: (units, 2) places at rest.
        steady: (frames,) which follow the frame before as their times say.
        time: (frames,) s; by default even.
        reference: variance of the reference's own error, over that by the image.
        coded: whether residuals are alike within blocks, as codecs leave them; without a codec, no
            frame is shown at another time than its own.

    Returns:
        (frames, units, 3); with too few frames to tell, a usual multiple of the image's own.
    """
    near = nearest(centre)
    out = np.empty_like(sigma)
    time = np.arange(len(motion), dtype=float) if time is None else time
    parts = np.array_split(np.arange(len(motion)), -(-len(motion) // _MOST_FRAMES))
    for part in (slice(frames[0], frames[-1] + 1) for frames in parts):
        seen = motion[part].astype(float), sigma[part].astype(float)
        out[part] = _calibrate(*seen, near, steady[part], time[part], reference, coded)
        del seen  # before the next part's
    return out


def _calibrate(
    motion: Floats,
    sigma: Floats,
    near: Ints,
    steady: Mask,
    time: Floats,
    reference: float,
    coded: bool,
) -> Floats:
    """Scales the uncertainties of some frames as ``calibrate_sigma`` does."""
    told = _regularised(sigma)
    factors, shares = _variance_factors(motion, told, near, steady, time, coded)
    return np.asarray(told * np.sqrt(factors + reference * shares))


def nearest(centre: Floats) -> Ints:
    """Returns the numbers (units, 3) of the units nearest to each, at places (units, 2)."""
    return np.asarray(cKDTree(centre).query(centre, k=min(4, len(centre)))[1][:, 1:])


def _regularised(sigma: Floats) -> Floats:
    """Shrinks the image's uncertainties towards the medians of their frame and unit.

    A figure comes from some tens of blocks and scatters by a fifth, most of which says nothing.
    """
    told = np.log(sigma)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # nothing is seen in some frames
        frame = np.nanmedian(told, axis=1, keepdims=True)
        unit = np.nanmedian(told - frame, axis=0, keepdims=True)
    return np.exp(frame + unit + _KEPT_DEVIATION * (told - frame - unit))


def _variance_factors(
    motion: Floats, sigma: Floats, near: Ints, steady: Mask, time: Floats, coded: bool
) -> tuple[Floats, Floats]:
    """Returns factors (frames, units, 3) by which variances are too small.

    Beside, the share (3,) of the reference frame's own error that the motion's shapes take up.
    Less scatter than a frame's own noise has is no codec's: residuals are alike within blocks by
    what they do not hold of the light, and tell too much of the reference's error as well.
    """
    usual = _CODEC_FACTOR if coded else 1.0
    factors, shares, levels = np.full(motion.shape, usual), np.zeros(3), np.full(3, np.nan)
    for dof in range(3 if len(motion) >= _LEAST_FRAMES else 0):
        shown, told = motion[..., dof], sigma[..., dof]
        if not np.isfinite(shown).any():
            continue
        found = motion_modes.separate_modes(shown, near, float(np.nanmedian(told)))
        noise = _noise(np.isfinite(shown), found)
        if coded:
            noise += _jitter(noise, found, steady, time)
        ratio = _variance_ratio(noise, told)
        if not np.isfinite(ratio).any():
            continue
        levels[dof] = level = float(np.nanmean(ratio[1:]))  # the first frame is the reference
        factors[..., dof] = _combined_factors(ratio, level, usual)
        shares[dof] = motion_modes.constant_share(found.amplitude)
    if coded and np.median(levels) < _FRAME_SHARE:
        return _variance_factors(motion, sigma, near, steady, time, coded=False)
    return factors, shares * np.fmin(levels / _FRAME_SHARE, 1.0)


def _combined_factors(ratio: Floats, level: float, usual: float) -> Floats:
    """Computes factors (frames, units) by frame and unit, shrunk towards the usual one."""
    by_frame = _shrunk_mean(ratio, level, 1)
    by_unit = _shrunk_mean(ratio / by_frame[:, None], 1.0, 0)
    belief = (level * len(ratio) + usual * _CODEC_WEIGHT) / (len(ratio) + _CODEC_WEIGHT)
    return np.asarray(by_frame[:, None] * by_unit[None, :] * belief / level)


def _noise(known: Mask, found: motion_modes.MotionModes) -> Floats:
    """Returns squared noise (frames, units) in what the shapes leave, NaN if unseen."""
    by_frame, by_unit = motion_modes.leverage(found.amplitude), motion_modes.leverage(found.shape.T)
    freedom = (1 - by_frame)[:, None] * (1 - by_unit)
    noise = found.residual**2 / np.maximum(freedom, _LEAST_FREEDOM)
    return np.where(known & (freedom > _LEAST_FREEDOM), noise, np.nan)


def _jitter(noise: Floats, found: motion_modes.MotionModes, steady: Mask, time: Floats) -> Floats:
    """Returns the variance (frames, units) by which frames are shown at other times.

    White noise shakes the shapes' amplitudes too, and is counted already.
    """
    known = np.isfinite(noise)
    told = motion_modes.amplitude_variance(known, found.shape)
    moved = motion_modes.amplitude_jitter(found.amplitude, steady, time, told) @ found.shape
    usual = float(np.nanmean(noise))
    own = motion_modes.leverage(found.shape.T) * usual
    return np.clip(moved**2 - own, 0.0, _JITTER * usual)


def _variance_ratio(spread: Floats, sigma: Floats) -> Floats:
    """Computes squared noise over the image's variance (frames, units), outliers clipped."""
    ratio = spread / sigma**2
    if not np.isfinite(ratio).any():
        return ratio
    return np.minimum(ratio, _OUTLIER_RATIO * np.nanmedian(ratio) / _CHI_SQUARE)


def _shrunk_mean(ratio: Floats, level: float, axis: int) -> Floats:
    count = np.isfinite(ratio).sum(axis=axis)
    return (np.nansum(ratio, axis=axis) + _PRIOR_WEIGHT * level) / (count + _PRIOR_WEIGHT)
