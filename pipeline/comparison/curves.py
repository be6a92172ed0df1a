"""Curves and maps of both sides: means over the region of interest, peak to peak of every unit."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from pipeline.comparison import band as bands
from pipeline.comparison.metrics import COPIES, LEVEL, limits
from pipeline.tracking.arrays import Floats, Mask

Reduction = Callable[[Floats], Floats]

_SPREAD = float(ndtri((1 + LEVEL) / 2))
"""Standard deviations at the ends of an interval."""
_SEEN = 0.9  # of the frames, or a unit's peak may have been missed


class Sides(NamedTuple):
    """The sides of a comparison at its frames.

    Attributes:
        measured, sigma: (frames, units, 3) with their standard uncertainty.
        simulated, nominal: likewise.
        copies: (samples, frames, units, 3) imperfect copies of the simulated one, or none.
        level: part of the copies in a band.
    """

    measured: Floats
    sigma: Floats
    simulated: Floats
    nominal: Floats
    copies: Floats
    level: float

    @property
    def motions(self) -> tuple[Floats, Floats, Floats]:
        """Measured, simulated, nominal."""
        return self.measured, self.simulated, self.nominal

    def within(self, copies: Floats) -> Floats:
        """Lower limit, median, upper limit (3, ...) of what was made of copies; NaN of none."""
        if len(copies) == 0:
            return np.full((3, *copies.shape[1:]), np.nan)
        return bands.limits(copies, self.level)


def rotation(motion: Floats) -> Floats:
    """|theta| (..., units) of motions (..., units, 3), rad."""
    return np.asarray(np.abs(motion[..., 2]))


def distance(motion: Floats) -> Floats:
    """|u| (..., units) of motions (..., units, 3), mm."""
    return np.asarray(np.linalg.norm(motion[..., :2], axis=-1))


def curve(sides: Sides, inside: Mask, of: Reduction, random: np.random.Generator) -> Floats:
    """Means (3 sides, frames, 3 estimates) of what ``of`` makes of motions, over some units.

    Args:
        sides: of the comparison.
        inside: (units,) which count.
        of: what is averaged.
        random: draws the copies of the measured side.
    """
    measured = sides.measured[:, inside]
    out = np.full((3, len(measured), 3), np.nan)
    for place, motion in enumerate(sides.motions):
        out[place, :, 0] = _mean(of(motion[:, inside]))
    out[0, :, 1:] = _measured_limits(measured, sides.sigma[:, inside], of, random).T
    out[1, :, 1:] = sides.within(_mean(of(sides.copies[:, :, inside])))[::2].T
    return out


def _measured_limits(
    motion: Floats, sigma: Floats, of: Reduction, random: np.random.Generator
) -> Floats:
    """Interval (2, frames) of a mean over units, by a bootstrap over them with the noise added."""
    units = motion.shape[1]
    copies = np.empty((COPIES, len(motion)))
    for copy in copies:
        drawn = random.integers(units, size=units) if units else slice(None)
        noise = random.standard_normal(motion.shape) * sigma[:, drawn]
        copy[:] = _mean(of(motion[:, drawn] + noise))
    return limits(copies)


def _mean(values: Floats) -> Floats:
    """Mean over the last axis of those that are known; NaN of none."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    total = np.where(known, values, 0.0).sum(axis=-1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def peak_to_peak(motion: Floats) -> Floats:
    """Largest less smallest (..., units, 3) of motions (..., frames, units, 3); NaN of none."""
    known = np.isfinite(motion)
    enough = known.mean(axis=-3) >= _SEEN
    high = np.where(known, motion, -np.inf).max(axis=-3)
    low = np.where(known, motion, np.inf).min(axis=-3)
    return np.where(enough, high - np.where(enough, low, 0.0), np.nan)


def peaks(sides: Sides) -> Floats:
    """Peak to peak (3 sides, units, 3 dofs, 3 estimates) of all units.

    The measured interval is that of the two extreme frames.
    """
    out = np.full((3, *sides.measured.shape[1:], 3), np.nan)
    for place, motion in enumerate(sides.motions):
        out[place, ..., 0] = peak_to_peak(motion)
    ends = [end(np.nan_to_num(sides.measured), axis=0) for end in (np.argmin, np.argmax)]
    sigma = np.hypot(*(np.take_along_axis(sides.sigma, end[None], axis=0)[0] for end in ends))
    out[0, ..., 1], out[0, ..., 2] = (out[0, ..., 0] + sign * _SPREAD * sigma for sign in (-1, 1))
    out[1, ..., 1:] = np.moveaxis(sides.within(peak_to_peak(sides.copies))[::2], 0, -1)
    return out


def coverage(sides: Sides, band: Floats) -> Floats:
    """Share (dofs,) of the measurements that lie in the band, widened by their noise.

    Args:
        sides: of the comparison.
        band: (3, frames, units, dofs) of displacements.
    """
    low, _, high = bands.widened(band, sides.sigma, sides.level)
    known = np.isfinite(sides.measured) & np.isfinite(low)
    inside = (sides.measured >= low) & (sides.measured <= high) & known
    count = known.sum(axis=(0, 1))
    return np.where(count > 0, inside.sum(axis=(0, 1)) / np.maximum(count, 1), np.nan)
