"""Estimates where units rest, of what their outlines tell and how units were made.

An outline tells a slender unit's place across it, but hardly along: there its tips alone do, and a
small error of all its edges, as of their blur, shifts it by pixels. How far units were assembled
off the design's places is alike for all of them, and those that are told well show it. So each
place is drawn to the design's along the axes of its fit's covariance, by what either is known to.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from pipeline.tracking.fit import PoseFits
from sim.core import Floats, Reals

_CHI_SQUARE = 0.455
"""Median of the square of a normal variable."""


class RestPlaces(NamedTuple):
    """Holds where units rest."""

    offset: Floats  # (units, 2) from the design's places, mm; NaN if not seen
    covariance: Floats  # (units, 2, 2) of its errors, mm^2

    @classmethod
    def by_design(cls, units: int) -> "RestPlaces":
        """Places all units where the design has them."""
        return cls(np.zeros((units, 2)), np.zeros((units, 2, 2)))

    def swing_variance(self, angle: Reals) -> Floats:
        """Computes variances (..., units, 3) of motions whose arms are off by these errors.

        Units turn by angles (..., units), rad; that of the rotation is zero.
        """
        cos, sin = np.cos(angle) - 1, np.sin(angle)
        (xx, xy), (_, yy) = self.covariance.transpose(1, 2, 0)
        joint = 2 * cos * sin * xy
        x = cos**2 * xx - joint + sin**2 * yy
        y = sin**2 * xx + joint + cos**2 * yy
        return np.stack([x, y, np.zeros_like(x)], axis=-1)


def estimate_rest_places(outlines: PoseFits) -> RestPlaces:
    """Draws places to the design's, by the variances of their fits and of how units were made.

    To the variance v that the noise causes along an axis, errors that all edges of a unit share
    add the square of v over the median of all. A unit that is not seen is as it may be made.
    """
    seen = np.isfinite(outlines.pose[:, 0])
    places = RestPlaces.by_design(len(seen))
    places.offset[~seen] = np.nan
    if not seen.any():
        return places
    noise = outlines.noise[seen, None, None] ** 2
    white, axes = np.linalg.eigh(outlines.curvature[seen, :2, :2] * noise)
    along = np.einsum("uia,ui->ua", axes, outlines.pose[seen, :2])
    white = np.maximum(white, np.finfo(float).tiny)
    usual = float(np.median(white))
    error = white + white**2 / usual
    well = white <= usual
    made = _manufacturing_variance(along[well], error[well])
    share = made / (made + error)
    places.offset[seen] = np.einsum("uia,ua->ui", axes, share * along)
    places.covariance[~seen] = made * np.eye(2)
    places.covariance[seen] = np.einsum("uia,ua,uja->uij", axes, share * error, axes)
    return places


def _manufacturing_variance(offset: Floats, error: Floats) -> float:
    """Finds the variance of offsets (n,) beyond that of their errors, by the median."""

    def excess(variance: float) -> float:
        return float(np.median(offset**2 / (variance + error))) - _CHI_SQUARE

    if excess(0.0) <= 0.0:
        return 0.0
    most = float(np.median(offset**2)) / _CHI_SQUARE
    return float(brentq(excess, 0.0, most))
