"""Filters the light's slopes over units in time, and takes out of poses what their noise put in.

A slope of the light over a unit, as a part of its brightness, looks like a shift of it: fitted anew
in each frame, it nearly doubles the variance of places. Light changes slowly, so the slopes follow
a random walk, whose steps the units tell together (Kalman, J. Basic Eng. 82 (1960) 35). A unit
whose slopes leave it, in the shadow of a hand, counts by what it shows alone, and starts anew.
"""

from __future__ import annotations

import numpy as np

from pipeline.tracking.fit import PoseFits
from pipeline.tracking.motion.uncertainty import variance_inflation
from sim.core import Mask

_INNOVATION = 16.0
"""Square of an innovation over its covariance that begins anew, two degrees of freedom."""
_MEAN_INNOVATION = 1.7
"""Its running mean over two likewise: a slope that the filter runs behind."""
_CHI_SQUARE = 0.455
"""Median of the square of a normal variable."""
_KEPT, _KEPT_OWN = 0.9, 0.8
"""Of running means from frame to frame."""


class LightSlopes:
    """Filters the light's slopes over units (units, 2), frame by frame (Kalman).

    Args:
        units: number of them.
        averaged: number of frames that the reference is the mean of; its noise is in all slopes.
    """

    def __init__(self, units: int, averaged: int = 1) -> None:
        self._noisier = 1 + 1 / averaged
        self._mean = np.zeros((units, 2))
        self._variance = np.zeros((units, 2, 2))
        self._process_noise = np.zeros(2)
        self._mean_innovation = np.ones(units)

    def apply(self, fits: PoseFits, good: Mask) -> None:
        """Corrects good fits (units,) in place for what is known of their slopes, and learns."""
        coded = max(variance_inflation(fits), 1.0)
        units = np.flatnonzero(good & np.isfinite(fits.curvature[:, 0, 0]))
        if not len(units):
            return
        self._variance += np.diag(np.maximum(self._process_noise, 0.0))
        white = fits.noise[units, None, None] ** 2
        covariance = self._noisier * coded * white * fits.curvature[units]
        known = self._variance[units]
        innovation = fits.photometry[units, 2:] - self._mean[units]
        total = covariance[:, 3:, 3:] + known
        inverse = np.linalg.inv(total)
        far = np.einsum("ui,uij,uj->u", innovation, inverse, innovation)
        self._mean_innovation[units] += (1 - _KEPT_OWN) * (far / 2 - self._mean_innovation[units])
        spread = np.einsum("uii->ui", total)
        excess = np.median(innovation**2, axis=0) / _CHI_SQUARE - np.median(spread, axis=0)
        self._process_noise = _KEPT * self._process_noise + (1 - _KEPT) * excess
        anew = (far > _INNOVATION) | (self._mean_innovation[units] > _MEAN_INNOVATION)
        lost = units[anew]
        self._mean[lost], self._variance[lost] = fits.photometry[lost, 2:], covariance[anew, 3:, 3:]
        self._mean_innovation[lost] = 1.0
        kept = units[~anew]
        innovation, inverse, known = innovation[~anew], inverse[~anew], known[~anew]
        self._mean[kept] += np.einsum("uij,ujk,uk->ui", known, inverse, innovation)
        self._variance[kept] -= known @ inverse @ known
        gain = covariance[~anew, :3, 3:] @ inverse
        fits.pose[kept] -= np.einsum("uij,uj->ui", gain, innovation)
        fits.photometry[kept, 2:] = self._mean[kept]
        across = np.concatenate([np.broadcast_to(np.eye(3), (len(kept), 3, 3)), -gain], axis=2)
        for values, scale in ((fits.curvature, 1 / (coded * white[~anew])), (fits.scatter, 1.0)):
            told = gain @ known @ gain.swapaxes(1, 2) * (scale / self._noisier)
            values[kept, :3, :3] = across @ values[kept] @ across.swapaxes(1, 2) + told
