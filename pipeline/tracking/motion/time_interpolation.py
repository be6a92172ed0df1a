"""Computes poses at the frames' times, from when rows and exposures showed them."""

import warnings
from typing import NamedTuple

import numpy as np

from pipeline.tracking.motion import motion_modes
from sim.core import Floats, Ints, Reals

_KNOTS, _FEWEST = 7, 4
"""Frames that a polynomial passes through, at most and at least."""
_LARGEST_RATIO = 0.56
"""Square of the ratio of what an order changes to that of the one before, at most; what the orders
beyond change goes on so."""
_CHUNK = 400
"""Frames that are looked at together, beside some before and after."""
_LEAST_UNITS = 9
"""Units, below which shapes that they share do not stand out."""


class _Interpolated(NamedTuple):
    """Holds poses (frames, units) at frames' times."""

    pose: Floats  # of one degree of freedom
    growth: Floats  # of their variance, over that of the poses seen
    truncation: Floats  # square of what the highest order changes


def at_frame_times(
    motion: Reals,
    sigma: Reals,
    time: Floats,
    late: Floats,
    bend: Reals,
    near: Ints,
    averaged: int = 1,
) -> tuple[Reals, Reals, Reals]:
    """Computes poses (frames, units, 3) at frames' times (frames,), by polynomials in time.

    A picture shows the mean over its exposure, x + bend x'' to second order, at its rows' times.
    What the units did in between is told by the few shapes in which they move together, nearly
    without noise: the pose changes by m(t) - bend m''(t) - m(t + late) of the motion m in these.
    Polynomials pass through the nearest frames, and have the order with the least error: noise, and
    what the highest changes.

    Args:
        motion: as seen, NaN where missing.
        sigma: their standard uncertainties.
        time: of the frames, s; middle of the exposure of the middle row.
        late: (frames, units) by how much later each pose was seen, s.
        bend: (frames, units, 3) share of the acceleration in each pose, s^2.
        near: (units, k) the nearest ones of each.
        averaged: number of frames that the reference is the mean of.

    Returns:
        Poses; their uncertainties by that of the poses they are made of; and the variance by what
        is not known of the motion in between, and of the reference.
    """
    out, grown, truncation = motion.copy(), np.ones_like(motion), np.zeros_like(motion)
    for begin in range(0, len(motion), _CHUNK):
        first = max(begin - _KNOTS, 0)
        part = slice(first, begin + _CHUNK + _KNOTS)
        core = slice(begin, begin + _CHUNK)
        if len(time[part]) <= _FEWEST:
            continue
        lag = np.where(np.isfinite(late[part]), late[part], 0.0)
        for dof in range(motion.shape[2]):
            shown, error = (values[part, :, dof].astype(float) for values in (motion, sigma))
            found = _interpolate(
                shown, error, time[part], lag, bend[part, :, dof].astype(float), near
            )
            for values, new in zip((out, grown, truncation), found, strict=True):
                values[core, :, dof] = new[begin - first :][:_CHUNK]
    own, rest = averaged / (averaged + 1), 1 / (averaged + 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # some units are not seen at rest
        origin = np.nan_to_num(
            [np.nanmean(one[:averaged], axis=0) for one in (truncation, grown - 1)]
        )
    missed = truncation + origin[0] + np.nan_to_num(sigma) ** 2 * rest * origin[1]
    return out, sigma * np.sqrt(own * grown + rest), np.maximum(missed, 0.0)


def _interpolate(
    shown: Floats, sigma: Floats, time: Floats, late: Floats, bend: Floats, near: Ints
) -> _Interpolated:
    """Interpolates poses (frames, units) at the frames' times."""
    together, share = motion_modes.filled(shown), np.ones(shown.shape[1])
    if shown.shape[1] >= _LEAST_UNITS and np.isfinite(sigma).any():
        found = motion_modes.separate_modes(shown, near, float(np.nanmedian(sigma)))
        together, share = found.amplitude @ found.shape, np.sum(found.shape**2, axis=0)
    changes, growths = [], []
    for knots in range(_FEWEST, min(_KNOTS + 1, len(time)) + 1):
        at, weight = _weights(time, late, bend, knots)
        changes.append(
            np.einsum("fuk,fuk->fu", weight, np.take_along_axis(together[..., None], at, 0))
        )
        growths.append(share * np.sum(weight**2, axis=2))
    change, growth = np.array(changes), np.array(growths)
    off = (change[:-1] - change[-1]) ** 2 - growth[-1] * sigma**2
    error = np.nansum(off / sigma**2 + np.where(np.isfinite(sigma), growth[:-1], 0.0), axis=2)
    best = np.argmin(error, axis=0), np.arange(len(time))  # all units tell of the order
    step = np.diff(change, axis=0)[-3:]
    size = np.nanmean(step**2, axis=2)
    ratio = np.minimum(np.sqrt(size[-1:] / np.maximum(size[:1], 1e-30)), _LARGEST_RATIO)[0][:, None]
    truncation = np.nan_to_num(np.maximum(off[best], 0.0) + ratio * step[-2:][0] ** 2)
    return _Interpolated(
        shown + change[best], 1 + growth[best], truncation / (1 - np.sqrt(ratio)) ** 2
    )


def middle_speed(motion: Reals, time: Floats, frame: int) -> Floats:
    """Returns speeds (units,) in mm/s in a frame, by those before and after; NaN near ends."""
    reach = (_KNOTS - 1) // 2
    near = slice(frame - reach, frame + reach + 1)
    if frame < reach or len(time[near]) < _KNOTS:
        return np.full(motion.shape[1], np.nan)
    unit = float(np.ptp(time[near])) / (_KNOTS - 1)
    powers = ((time[near] - time[frame]) / unit) ** np.arange(_KNOTS)[:, None]
    weight = np.linalg.solve(powers, np.arange(_KNOTS) == 1) / unit
    return np.asarray(np.linalg.norm(np.tensordot(weight, motion[near, :, :2], 1), axis=1))


def _weights(time: Floats, late: Floats, bend: Floats, knots: int) -> tuple[Ints, Floats]:
    """Returns the frames (frames, units, knots) about each, and their weights in a pose's change.

    That is the value of the polynomial through the poses as they were seen at the frame's time,
    less bend times its second derivative, less the pose seen.
    """
    frame = np.arange(len(time))[:, None]
    first = frame - (knots - 1) // 2 - ((knots % 2 == 0) & (late > 0))
    near = np.clip(first, 0, len(time) - knots)[..., None] + np.arange(knots)
    unit = float(np.ptp(time)) / (len(time) - 1)
    seen = np.take_along_axis((time[:, None] + late)[..., None], near, 0)
    apart = (seen - time[:, None, None]) / unit
    wanted = np.zeros((knots, 2))
    wanted[0, 0], wanted[2, 1] = 1.0, 2.0 / unit**2
    solved = np.linalg.solve(apart[..., None, :] ** np.arange(knots)[:, None], wanted[None, None])
    weight = solved[..., 0] - bend[..., None] * solved[..., 1]
    return near, weight - (near == frame[..., None])
