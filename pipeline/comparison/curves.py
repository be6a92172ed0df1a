"""Computes curves along the frames and maps, peak to peak of every unit, of both sides."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from pipeline.comparison import tolerance_band as bands
from pipeline.comparison.compared_quantities import Quantity
from pipeline.comparison.metrics import COPIES, LEVEL, interval_ends
from pipeline.comparison.redrive import fit_spline
from sim.core import Floats

_SIGMAS = float(ndtri((1 + LEVEL) / 2))
"""Standard deviations at the ends of an interval."""
_TRIALS = 50
_SEEN_SHARE = 0.9  # of the frames, or a unit's peak may have been missed


class Sides(NamedTuple):
    """Holds the sides of a comparison at its frames."""

    measured: Floats  # (frames, units, 3)
    sigma: Floats  # its standard uncertainty
    simulated: Floats  # (frames, units, 3)
    nominal: Floats  # likewise
    copies: Floats  # (samples, frames, units, 3) imperfect copies of the simulated one, or none
    level: float  # part of the copies in a band

    @property
    def motions(self) -> tuple[Floats, Floats, Floats]:
        """Measured, simulated, nominal."""
        return self.measured, self.simulated, self.nominal

    def within(self, copies: Floats) -> Floats:
        """Computes lower limit, median and upper limit (3, ...) over copies; NaN of none."""
        if len(copies) == 0:
            return np.full((3, *copies.shape[1:]), np.nan)
        return bands.band_limits(copies, self.level)


def quantity_curve(
    sides: Sides, smooth: Floats, quantity: Quantity, random: np.random.Generator
) -> Floats:
    """Computes a quantity along the frames (3 sides, frames, 3 estimates).

    Noise makes magnitudes larger. What it adds to them in the mean is taken out of the measured
    interval, as a root sum of squares: in the track, by that of the motion `smooth` (of
    `smooth_motion`), and in the copies, by their mean.
    """
    of, units = quantity.along, quantity.units
    out = np.full((3, len(sides.measured), 3), np.nan)
    for place, motion in enumerate(sides.motions):
        out[place, :, 0] = of(motion[:, units], units)
    out[0, :, 1:] = _measured_limits(sides, smooth, quantity, random).T
    out[1, :, 1:] = sides.within(of(sides.copies[:, :, units], units))[::2].T
    return out


def _measured_limits(
    sides: Sides, smooth: Floats, quantity: Quantity, random: np.random.Generator
) -> Floats:
    """Computes an interval (2, frames) by a bootstrap over units, with the noise."""
    units, count = quantity.units, len(quantity.units)
    copies = np.empty((COPIES, len(sides.measured)))
    for copy in copies:
        sampled = quantity.sampled and count > 0
        drawn = units[random.integers(count, size=count)] if sampled else units
        noise = random.standard_normal((len(copy), count, 3)) * sides.sigma[:, drawn]
        copy[:] = quantity.along(sides.measured[:, drawn] + noise, drawn)
    ends = interval_ends(copies)
    if quantity.signed:
        return ends
    mean = np.zeros(len(smooth))
    for _ in range(_TRIALS):
        noise = random.standard_normal((len(mean), count, 3)) * sides.sigma[:, units]
        mean += quantity.along(smooth[:, units] + noise, units) / _TRIALS
    added = np.nan_to_num(mean**2 - quantity.along(smooth[:, units], units) ** 2)
    again = copies.mean(axis=0) ** 2 - quantity.along(sides.measured[:, units], units) ** 2
    return np.sqrt(np.maximum(ends**2 - again - added, 0.0))


def peak_to_peak(motion: Floats) -> Floats:
    """Subtracts extremes (..., units, 3) of motions (..., frames, units, 3); NaN of none.

    The extremes are those of parabolas through the extreme frames and their neighbours: a peak
    between two frames is not missed.
    """
    enough = np.isfinite(motion).mean(axis=-3) >= _SEEN_SHARE
    span = _interpolated_peak(motion) + _interpolated_peak(-motion)
    return np.where(enough, span, np.nan)


def _interpolated_peak(motion: Floats) -> Floats:
    values = np.where(np.isfinite(motion), motion, -np.inf)
    at = values.argmax(axis=-3, keepdims=True)
    near = [np.clip(at + step, 0, motion.shape[-3] - 1) for step in (-1, 0, 1)]
    before, top, after = (np.take_along_axis(values, each, axis=-3) for each in near)
    with np.errstate(invalid="ignore", divide="ignore"):
        rise = (after - before) ** 2 / (8 * (2 * top - before - after))
    inner = (near[0] < at) & (at < near[2]) & np.isfinite(rise)
    return np.asarray(np.where(inner, top + rise, top).squeeze(axis=-3))


def estimate_peaks(sides: Sides, smooth: Floats, random: np.random.Generator) -> Floats:
    """Computes peak to peak (3 sides, units, 3 dofs, 3 estimates) of all units.

    Noise makes extremes larger, at whichever frames they are. The measured interval is that of the
    noise at the two extreme frames, about the value less what noise adds to the motion `smooth`,
    that of `smooth_motion`.
    """
    out = np.full((3, *sides.measured.shape[1:], 3), np.nan)
    for place, motion in enumerate(sides.motions):
        out[place, ..., 0] = peak_to_peak(motion)
    known = np.isfinite(sides.measured)
    ends = [np.where(known, sign * sides.measured, -np.inf).argmax(axis=0) for sign in (-1, 1)]
    sigma = np.hypot(*(np.take_along_axis(sides.sigma, end[None], axis=0)[0] for end in ends))
    middle = out[0, ..., 0] - _noise_bias(sides, smooth, random)
    out[0, ..., 1], out[0, ..., 2] = (middle + sign * _SIGMAS * sigma for sign in (-1, 1))
    out[1, ..., 1:] = np.moveaxis(sides.within(peak_to_peak(sides.copies))[::2], 0, -1)
    return out


def _noise_bias(sides: Sides, smooth: Floats, random: np.random.Generator) -> Floats:
    """Estimates how much (units, dofs) noise adds to peak to peak: that of the smoothed motion."""
    still, added = peak_to_peak(smooth), np.zeros(smooth.shape[1:])
    for _ in range(_TRIALS):
        noise = random.standard_normal(smooth.shape) * sides.sigma
        added += (peak_to_peak(smooth + noise) - still) / _TRIALS
    return added


def smooth_motion(sides: Sides) -> Floats:
    """Smooths the measured motion; NaN for units that are seldom seen."""
    out = np.full_like(sides.measured, np.nan)
    frames = np.arange(len(out), dtype=np.float64)
    observed = np.isfinite(sides.measured + sides.sigma)
    for unit, dof in np.argwhere(observed.mean(axis=0) >= _SEEN_SHARE):
        known = observed[:, unit, dof]
        course, sigma = (each[known, unit, dof] for each in (sides.measured, sides.sigma))
        out[known, unit, dof] = fit_spline(frames[known], course, sigma)(frames[known])
    return out


def band_coverage(sides: Sides, band: Floats) -> Floats:
    """Computes the share (dofs,) of measurements in a band, widened by their noise.

    The band (3, frames, units, dofs) is of displacements.
    """
    low, _, high = bands.widen_band(band, sides.sigma, sides.level)
    known = np.isfinite(sides.measured) & np.isfinite(low)
    inside = (sides.measured >= low) & (sides.measured <= high) & known
    count = known.sum(axis=(0, 1))
    return np.where(count > 0, inside.sum(axis=(0, 1)) / np.maximum(count, 1), np.nan)


def expected_coverage(copies: Floats, band: Floats, level: float) -> Floats:
    """Computes the share (dofs,) of its motion in the band that a copy has with a probability.

    One specimen is one draw: where it is far off in a constant, all its units leave the band
    together.

    Args:
        copies: (samples, frames, units, dofs) that the band was drawn from.
        band: (3, frames, units, dofs).
        level: the probability.
    """
    if len(copies) == 0:
        return np.full(copies.shape[-1], np.nan)
    known = np.isfinite(copies).sum(axis=(1, 2))
    inside = ((copies >= band[0]) & (copies <= band[2])).sum(axis=(1, 2))
    return np.asarray(np.quantile(inside / np.maximum(known, 1), 1 - level, axis=0))
