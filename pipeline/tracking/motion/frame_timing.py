"""Finds dropped and duplicated frames by the motion itself."""

from __future__ import annotations

import numpy as np

from sim.core import Floats, Ints, Mask

STEADY, DUPLICATE, DROPPED = range(3)
"""Timing of a frame: as the file says; shows the instant before again; a frame is missing."""

_BESIDE = 3
_ALIKE = 0.7
_VISIBLE = 6.0
"""Steps must be so many standard uncertainties long before anything can be told from them."""
_STILL = 0.25
_WINDOW = 4
_DEGREE = 4
_GAPS = (0, 1, 2)
"""Numbers of frames that may be missing, none first."""
_ROUGH = 3.0
"""What is left of smooth motion, over a standard uncertainty, where a gap may be the reason."""
_SMOOTH = 20.0
"""The same where the gap is allowed for, at most: what is rougher is a jolt."""
_EVEN = 0.2
"""Least part of the steps after a gap that those before have, and the reverse: none where motion
sets in, ends or jumps."""
_BETTER = 0.2
"""A gap must make the squared residuals of smooth motion so much smaller."""


def timing_faults(time: Floats, motion: Floats, sigma: Floats) -> Ints:
    """Classifies the timing (frames,) of every frame.

    A frame that repeats the one before has no step where those about it have one. After a gap the
    motion goes on smoothly, but only if the frames from there on are later than they say. Where the
    specimen is at rest or jolts, nothing is flagged.

    Args:
        time: (frames,) s, as the file says.
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) standard uncertainties.
    """
    place = motion[..., :2]
    noise = np.array(
        [np.nanmedian(told) if np.isfinite(told).any() else np.inf for told in sigma[..., :2]]
    )
    out = np.full(len(motion), STEADY)
    out[_repeated(place, noise)] = DUPLICATE
    out[_late(time, place, noise, out == DUPLICATE)] = DROPPED
    return out


def _repeated(place: Floats, noise: Floats) -> Mask:
    out = np.zeros(len(place), dtype=bool)
    for step in range(2, len(place) - 3):
        steps = np.diff(place[max(0, step - _BESIDE) : step + 2 + _BESIDE], axis=0)
        now, usual = min(step, _BESIDE), float(noise[step : step + 2].max())
        this, before, after = steps[now], steps[:now], steps[now + 1 :]
        out[step + 1] = _stands(this, before, after, usual) or (
            _stands(this, before[-1:], after[:1], usual)  # quick motions are alike but nearby
            and not _rests(this, np.concatenate([before, after]))
        )
    return out


def _rests(step: Floats, about: Floats) -> bool:
    """Checks for other steps about that are none either: motion by fits and starts."""
    known = np.isfinite(step).all(axis=-1) & np.isfinite(about).all(axis=(0, 2))
    length = np.sqrt(np.mean(about[:, known] ** 2, axis=(1, 2)))
    return bool((length < _STILL * np.median(length)).any())


def _stands(step: Floats, before: Floats, after: Floats, noise: float) -> bool:
    """Checks that a step is none, although those before and after are alike and can be seen."""
    about = np.concatenate([before, after])
    known = np.isfinite(step).all(axis=-1) & np.isfinite(about).all(axis=(0, 2))
    if not known.any():
        return False
    usual = np.median(about[:, known], axis=0)
    length = np.sqrt(np.mean(usual**2))
    sides = [np.median(side[:, known], axis=0) - usual for side in (before, after)]
    apart = max(np.sqrt(np.mean(side**2)) for side in sides)
    this = np.sqrt(np.mean(step[known] ** 2))
    return bool(length > _VISIBLE * noise and apart < _ALIKE * length and this < _STILL * length)


def _late(time: Floats, place: Floats, noise: Floats, repeated: Mask) -> Mask:
    """Finds frames that come later than they say, by a frame or two."""
    out = np.zeros(len(place), dtype=bool)
    shown = np.nonzero(~repeated)[0]
    interval = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    count = np.arange(len(time)) - np.cumsum(repeated)
    extra = np.maximum(np.round(np.diff(time, prepend=time[0]) / interval) - 1, 0)
    clock = count + np.cumsum(extra)
    for middle in range(_WINDOW, len(shown) - _WINDOW + 1):
        window = shown[middle - _WINDOW : middle + _WINDOW]
        near = place[window].reshape(len(window), -1)
        near = near[:, np.isfinite(near).all(axis=0)]
        after = np.arange(len(window)) >= _WINDOW
        rough = (
            [_roughness(clock[window] + gap * after, near) for gap in _GAPS] if near.size else []
        )
        if rough and _goes_on(near) and np.sqrt(rough[0]) > _ROUGH * noise[shown[middle]]:
            most = min(_BETTER * rough[0], (_SMOOTH * noise[shown[middle]]) ** 2)
            out[shown[middle]] = min(rough[1:]) < most
    return out


def _goes_on(motion: Floats) -> bool:
    """Checks that motions (frames, n) are about as quick in the second half as in the first."""
    steps = np.sqrt(np.mean(np.diff(motion, axis=0) ** 2, axis=1))
    half = len(motion) // 2
    before, after = np.median(steps[: half - 1]), np.median(steps[half:])
    return bool(min(before, after) > _EVEN * max(before, after))


def _roughness(clock: Floats, motion: Floats) -> float:
    """Returns the mean square of what motions (frames, n) are off polynomials in time."""
    basis = np.linalg.qr(np.vander((clock - clock.mean()) / np.ptp(clock), _DEGREE + 1))[0]
    rest = motion - basis @ (basis.T @ motion)
    return float(np.mean(rest**2))
