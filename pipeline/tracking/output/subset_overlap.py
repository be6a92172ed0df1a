"""Estimates the overlap of a DIC system's subsets, and the uncertainty of poses by it.

A point's displacement is that of a square subset of the picture, so its error is the mean of its
pixels' errors: at distances dx, dy along rows and columns, points share the part

    c = max(0, 1 - |dx| / w) max(0, 1 - |dy| / w)

of subsets w wide, which is the correlation C of their errors; that subsets lie along the axes of
a picture that is turned against the specimen hardly changes it. A rigid fit takes from the errors
what moves a unit as a whole, so that its residuals show P C P: less than what the points share.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from scipy.optimize import brentq

from sim.core import Floats

_OUTLIER = 4.0  # of a usual error, from which on a point counts as gone astray
_PAIR_DISTANCE = 0.5 + 1e-6  # of the points' extent
_ACCURACY = 0.01  # of the width, as a part of the widest
_NARROWEST = 1e-9  # mm, of subsets that share nothing
_TINY = 1e-12


class PointErrors(NamedTuple):
    """Holds the propagation of point errors of variance one through a unit's rigid fit."""

    covariance: Floats  # (n, n) of either component
    basis: Floats  # (2, n, 3) orthonormal one of the rigid motions, of both components
    covariance_basis: Floats  # (2, n, 3) covariance times basis
    fit_covariance: Floats  # (3, 3) covariance of what the fit takes, along the basis

    @property
    def residual_variance(self) -> float:
        """Sums the variances of all residuals."""
        return max(float(2 * len(self.covariance) - np.trace(self.fit_covariance)), _TINY)

    def pair_product(self, pairs: Floats) -> float:
        """Sums the products of residuals over pairs of points, where `pairs` (n, n) is one."""
        q, near = self.basis, pairs @ self.basis
        by_fit = 2 * (near * self.covariance_basis).sum() - (near * (q @ self.fit_covariance)).sum()
        return float(2 * (pairs * self.covariance).sum() - by_fit)


def point_errors(place: Floats, width: float) -> PointErrors:
    """Computes the errors of points (n, 2), mm from the centre of their unit, for such subsets."""
    apart = np.abs(place[:, None] - place[None]) / max(width, _NARROWEST)
    covariance = np.maximum(1.0 - apart, 0.0).prod(axis=-1)
    basis = np.linalg.qr(_rigid_motions(place))[0].reshape(2, len(place), 3)
    covariance_basis = covariance @ basis
    return PointErrors(
        covariance, basis, covariance_basis, np.einsum("cni,cnj->ij", basis, covariance_basis)
    )


def _rigid_motions(place: Floats) -> Floats:
    """Lists the displacements (2 n, 3) of points, x before y, by unit shifts and a unit turn."""
    zero, one = np.zeros(len(place)), np.ones(len(place))
    return np.column_stack([[*one, *zero], [*zero, *one], [*-place[:, 1], *place[:, 0]]])


def inflate_sigma(place: Floats, width: float) -> Floats:
    """Computes the factors (3,) of a pose's standard uncertainty over that by separate errors."""
    found = point_errors(place, width)
    to_pose = np.linalg.pinv(np.linalg.qr(_rigid_motions(place))[1])
    with_shared = np.einsum("ij,jk,ik->i", to_pose, found.fit_covariance, to_pose)
    separate = (to_pose**2).sum(axis=1)
    freedom = max(2 * len(place) - 3, 1)
    return np.asarray(np.sqrt(with_shared / separate * freedom / found.residual_variance))


class Residuals(NamedTuple):
    """Holds residuals of a rigid fit to the points of a unit at one time."""

    place: Floats  # (n, 2) at rest, from the centre of the unit, mm
    residual: Floats  # (n, 2) of their displacements, mm

    def without_outliers(self) -> Self:
        """Drops outliers."""
        size = (self.residual**2).sum(axis=1)
        inliers = size <= _OUTLIER**2 * np.median(size)
        return self._replace(place=self.place[inliers], residual=self.residual[inliers])

    def pairs(self) -> Floats:
        """Marks by one (n, n) the pairs no farther apart than half of the points' extent."""
        apart = np.linalg.norm(self.place[:, None] - self.place[None], axis=-1)
        near = apart <= _PAIR_DISTANCE * np.ptp(self.place, axis=0).max()
        return near.astype(float) - np.eye(len(near))


def subset_width(samples: Sequence[Residuals], widest: float) -> float:
    """Fits the width of subsets, mm, to the correlation of residuals.

    Zero if neighbours are no more alike than with separate errors; `widest` if more than with that.
    Subsets seem a little narrower than they are, since some of their pixels count for more.
    """
    inliers = [sample.without_outliers() for sample in samples]
    pairs_and_sizes = [
        (sample, sample.pairs(), float((sample.residual**2).sum())) for sample in inliers
    ]
    found = sum(
        float((sample.residual * (pairs @ sample.residual)).sum())
        for sample, pairs, _ in pairs_and_sizes
    )

    def excess(width: float) -> float:
        """Computes the excess of the pair products that subsets so wide predict."""
        total = -found
        for sample, pairs, size in pairs_and_sizes:
            of = point_errors(sample.place, width)
            total += size * of.pair_product(pairs) / of.residual_variance
        return total

    if excess(0.0) >= 0.0:
        return 0.0
    if excess(widest) <= 0.0:
        return widest
    return float(brentq(excess, 0.0, widest, xtol=_ACCURACY * widest))
