"""Dropped and duplicated frames, found by the motion itself."""

from __future__ import annotations

import numpy as np

from pipeline.tracking.arrays import Floats, Ints

STEADY, DUPLICATE, DROPPED = range(3)
"""Timing of a frame: as the file says; shows the instant before again; a frame is missing."""

_BESIDE = 3
_ALIKE = 0.7
_VISIBLE = 6.0
"""Steps must be so many standard uncertainties long before anything can be told from them."""
_STILL = 0.25
_TWICE = (1.6, 2.6)
_BETTER = 0.6


def faults(motion: Floats, sigma: Floats) -> Ints:
    """The timing (frames,) of every frame.

    A frame that repeats the one before has no step where those about it have one; a frame after a
    gap has one of twice the length. Where the specimen is at rest or turns round, none is flagged.

    Args:
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) standard uncertainties.
    """
    steps = np.diff(motion[..., :2], axis=0)
    noise = np.sqrt(np.nanmedian(sigma[..., :2] ** 2, axis=(1, 2)))
    out = np.full(len(motion), STEADY)
    for step in range(2, len(steps) - 2):
        before = steps[max(0, step - _BESIDE) : step]
        after = steps[step + 1 : step + 1 + _BESIDE]
        out[step + 1] = _judged(steps[step], before, after, float(noise[step : step + 2].max()))
    return out


def _judged(step: Floats, before: Floats, after: Floats, noise: float) -> int:
    about = np.concatenate([before, after])
    known = np.isfinite(step).all(axis=-1) & np.isfinite(about).all(axis=(0, 2))
    if not known.any():
        return STEADY
    usual = np.median(about[:, known], axis=0)
    length = np.sqrt(np.mean(usual**2))
    if length < _VISIBLE * noise or not all(
        _alike(np.median(side[:, known], axis=0), usual) for side in (before, after)
    ):
        return STEADY
    this = step[known]
    ratio = float((this * usual).sum() / (usual**2).sum())
    if abs(ratio) < _STILL and np.sqrt(np.mean(this**2)) < _STILL * length:
        return DUPLICATE
    once, twice = (np.linalg.norm(this - share * usual) for share in (1, 2))
    if _TWICE[0] < ratio < _TWICE[1] and twice < _BETTER * once:
        return DROPPED
    return STEADY


def _alike(steps: Floats, usual: Floats) -> bool:
    """Whether the steps on one side differ little from those on both."""
    return bool(np.linalg.norm(steps - usual) < _ALIKE * np.linalg.norm(usual))
