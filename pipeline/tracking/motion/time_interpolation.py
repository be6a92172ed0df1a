"""Interpolates poses in time, from when rows and exposures showed them to the frames' times."""

import itertools
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints, Reals

_KNOTS, _FEWEST = 7, 4
"""Poses that a polynomial passes through, at most and at least."""


class _Interpolated(NamedTuple):
    """Holds what polynomials of rising order tell of a unit."""

    known: Ints  # (n,) frames in which it is seen
    pose: Floats  # (orders, n, 3) at the frames' times
    growth: Floats  # (orders, n, 3) variance over that of the poses seen


def at_frame_times(
    motion: Reals, sigma: Reals, time: Floats, late: Floats, bend: Reals, averaged: int = 1
) -> tuple[Reals, Reals, Reals]:
    """Computes poses (frames, units, 3) at frames' times (frames,), by polynomials in time.

    A picture shows the mean over its exposure: x + bend x'', to second order. Polynomials pass
    through the poses that are nearest in time, and have the order with the least error: noise, and
    what the highest changes.

    Args:
        motion: as seen, NaN where missing.
        sigma: their standard uncertainties.
        time: of the frames, s; middle of the exposure of the middle row.
        late: (frames, units) by how much later each pose was seen, s.
        bend: (frames, units, 3) share of the acceleration in each pose, s^2.
        averaged: number of frames that the reference is the mean of.

    Returns:
        Poses; their uncertainties by that of the poses they are made of; and the variance by what
        is not known of the motion in between, and of the reference.
    """
    out, spread, missed = motion.copy(), sigma.copy(), np.zeros_like(motion)
    own, rest = averaged / (averaged + 1), 1 / (averaged + 1)
    error = np.zeros((_KNOTS - _FEWEST + 1, *motion.shape[::2]))
    for turn, unit in itertools.product(range(2), range(motion.shape[1])):
        found = _unit_interpolated(motion[:, unit], time, late[:, unit], bend[:, unit])
        if found is None:
            continue
        known, pose, growth = found
        told = sigma[known, unit].astype(float)
        change = (pose[-1] - pose[:-1]) ** 2 - growth[-1] * told**2
        if turn == 0:  # all units tell of the order
            error[: len(change), known] += change / told**2 + growth[:-1]
            error[len(change) :, known] = np.inf
            continue
        best = np.minimum(np.argmin(error[:, known], axis=0), len(change) - 1)
        at = best, np.arange(len(known))[:, None], np.arange(3)
        left, grown, first = np.maximum(change[at], 0.0), growth[at], known < averaged
        out[known, unit] = pose[at]
        spread[known, unit] = told * np.sqrt(own * grown + rest)
        if first.any():
            left += left[first].mean(axis=0) + told**2 * rest * (grown[first].mean(axis=0) - 1)
        missed[known, unit] = np.maximum(left, 0.0)
    return out, spread, missed


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


def _unit_interpolated(
    motion: Reals, time: Floats, late: Floats, bend: Reals
) -> _Interpolated | None:
    """Passes polynomials of rising order through the poses (frames, 3) of a unit, if they suffice.

    Each has one knot more than the one before; the last only tells what it changes.
    """
    known = np.flatnonzero(np.isfinite(motion[:, 0]))
    if len(known) <= _FEWEST:
        return None
    seen, now = time[known] + late[known], time[known]
    shown, share = motion[known].astype(float), bend[known].astype(float)
    most = min(_KNOTS + 1, len(known))
    found = [_passed(seen, now, shown, share, knots) for knots in range(_FEWEST, most + 1)]
    pose, growth = (np.array(values) for values in zip(*found, strict=True))
    return _Interpolated(known, pose, growth)


def _nearest(seen: Floats, now: Floats, knots: int) -> Ints:
    """Returns the numbers (n, knots) of those in a row that are about each time."""
    first = np.arange(len(seen)) - (knots - 1) // 2
    first -= (knots % 2 == 0) & (seen > now)
    return np.asarray(np.clip(first, 0, len(seen) - knots)[:, None] + np.arange(knots))


def _passed(
    seen: Floats, now: Floats, shown: Floats, bend: Floats, knots: int
) -> tuple[Floats, Floats]:
    """Returns polynomials' values less bend times second derivatives (n, 3), and their growth."""
    near = _nearest(seen, now, knots)
    apart = seen[near] - now[:, None]
    unit = float(np.ptp(seen)) / (len(seen) - 1)
    order = np.arange(knots)
    powers = (apart[:, None] / unit) ** order[:, None]
    wanted = np.zeros((knots, 2))
    wanted[0, 0], wanted[2, 1] = 1.0, 2.0 / unit**2
    value, second = np.moveaxis(np.linalg.solve(powers, wanted[None]), -1, 0)
    weight = value[..., None] - bend[:, None] * second[..., None]
    return np.einsum("nkd,nkd->nd", weight, shown[near]), np.sum(weight**2, axis=1)
