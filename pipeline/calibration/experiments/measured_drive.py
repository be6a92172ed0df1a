"""Smooths the measured motion of the held units: without bias, and with its covariance.

Each history is a cubic spline with equal intervals that begins at zero, as the simulation does, and
a constant that stays with its unit, which is no motion. A spline that smooths until its residuals
are as large as the noise would leave out a part of the motion that all driven units have in common;
least squares leave out only what the intervals are too long for. Their number is found over all
histories together by the criterion of Akaike, corrected for short series (Hurvich & Tsai 1989). The
criterion leaves out what is worth no unknown of its own, but all of that together may be worth many
standard errors of a constant, and free units that resonate show it larger still. So the intervals
are a quarter as long, and what is left out 256 times smaller.

The coefficients are linear in the measured values, so that their covariance is known: each column
of its root is a change of the drive by one standard deviation, independent of all others.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import BSpline

from pipeline.comparison import redrive
from sim.core import Floats
from sim.scene import Scene

_DEGREE = 3
_ROUNDING = 0.01
"""Mean square of residuals, in the tracker's variances, below which they are rounding."""
_FINER, _COARSE = 4, 2
"""Times as many intervals as the criterion finds are wanted; with fewer than that is warned of."""
_COEFFICIENT_SHARE = 0.5
"""Coefficients are at most this part of the frames."""


class DriveChange(NamedTuple):
    """Perturbs one dof's history of a drive by one standard deviation of its noise."""

    place: int
    dof: int
    value: Floats  # (n,) at the knots
    slope: Floats  # (n,) there


def apply_changes(
    motion: redrive.HermiteMotion, changes: Sequence[DriveChange], size: Floats
) -> redrive.HermiteMotion:
    """Adds changes of a size each to a motion, in standard deviations."""
    value, slope = (np.array(part) for part in (motion.value, motion.slope))
    for each, times in zip(changes, size, strict=True):
        value[:, each.place, each.dof] += times * each.value
        slope[:, each.place, each.dof] += times * each.slope
    return motion._replace(value=value, slope=slope)


class SmoothedDrive(NamedTuple):
    """Holds the drive of a fit."""

    held: redrive.HeldMotion  # units, and their motion by values and slopes at the knots
    changes: tuple[DriveChange, ...]  # of that motion, independent of one another
    coarse: bool  # whether the frames are too few for enough intervals


@dataclass(frozen=True)
class _HeldHistory:
    """Holds displacement histories of the held units, at rest in the first frame."""

    time: Floats  # (n,) s
    measured: Floats  # (n, n_held, 3) mm, mm, rad
    sigma: Floats  # (n, n_held, 3) their uncertainty
    observed: np.ndarray  # (n, n_held) whether the unit was seen
    bias: Floats  # (3,) standard deviation of what stays with a unit through all frames
    reach: Floats  # (3,) range of the motions, mm, mm, rad

    def equations(self, intervals: int, place: int, dof: int) -> tuple[Floats, Floats]:
        """Builds whitened equations (n, 1 + n_coefficients) of a history, and right sides (n,).

        The first unknown is the constant; the first coefficient is zero. Where no frame tells a
        coefficient, the history goes on as it went, give or take the range of the motions.
        """
        kept = self.observed[:, place]
        sigma = self.sigma[kept, place, dof]
        basis = self.basis(intervals)[kept]
        straight = np.diff(np.eye(basis.shape[1]), 2, axis=0)
        basis[:, 0], straight[:, 0] = 1.0, 0.0
        shift = np.eye(1, basis.shape[1]) / self.bias[dof]
        rows = np.concatenate([basis / sigma[:, None], straight / self.reach[dof], shift])
        right_side = self.measured[kept, place, dof] / sigma
        return rows, np.append(right_side, np.zeros(len(straight) + 1))

    def basis(self, intervals: int) -> Floats:
        """Evaluates all splines of the basis at the frames (n, n_coefficients)."""
        knots = self.knots(intervals)
        return np.asarray(BSpline.design_matrix(self.time, knots, _DEGREE).toarray())

    def knots(self, intervals: int) -> Floats:
        """Places the knots of the spline, those at the ends fourfold."""
        inner = np.linspace(0.0, self.time[-1], intervals + 1)
        return np.pad(inner, _DEGREE, mode="edge")

    def misfit(self, intervals: int, place: int, dof: int) -> float:
        """Sums squared residuals of a spline of so many intervals, in the tracker's variances."""
        rows, right_side = self.equations(intervals, place, dof)
        residual = rows @ np.linalg.lstsq(rows, right_side)[0] - right_side
        return float(np.sum(residual[: np.count_nonzero(self.observed[:, place])] ** 2))


def smooth_drive(track: xr.Dataset, scene: Scene, bias: Floats) -> SmoothedDrive:
    """Smooths the motion of the held units of a track, which begins at rest.

    The track is in the design's frame, the scene under its planned drive; `bias` (3,) is the
    standard deviation of what stays with a unit through all frames: mm, mm, rad.

    Raises:
        UserError: no driven unit was seen.
    """
    held = redrive.filter_held_motion(track, scene)
    seen = _held_history(track, held, scene, bias)
    places = np.flatnonzero(~held.assumed).tolist()
    most = max(1, int(_COEFFICIENT_SHARE * len(seen.time)) - _DEGREE)
    powers = [1 << k for k in range(most.bit_length())]
    best = min(powers, key=lambda count: _criterion(seen, places, count))
    intervals = min(_FINER * best, most)
    value, slope = (np.zeros((intervals + 1, len(held.unit), 3)) for _ in range(2))
    changes: list[DriveChange] = []
    for place in places:
        for dof in range(3):
            values, slopes = _fit_history(seen, intervals, place, dof)
            value[:, place, dof], slope[:, place, dof] = values[0], slopes[0]
            pairs = zip(values[1:], slopes[1:], strict=True)
            changes.extend(DriveChange(place, dof, *pair) for pair in pairs)
    mean, guessed = held.driven & ~held.assumed, held.driven & held.assumed
    for course in (value, slope):
        course[:, guessed] = course[:, mean].mean(axis=1, keepdims=True)
    motion = redrive.HermiteMotion(seen.time[-1] / intervals, value, slope)
    return SmoothedDrive(held._replace(motion=motion), tuple(changes), intervals < _COARSE * best)


def _held_history(
    track: xr.Dataset, held: redrive.HeldMotion, scene: Scene, bias: Floats
) -> _HeldHistory:
    chosen = track.sel(unit=scene.lattice.id[held.unit])
    measured, sigma = (
        chosen[name].transpose("time", "unit", "dof").values.astype(float)
        for name in ("displacement", "sigma")
    )
    observed = np.isfinite(measured).all(axis=2) & np.isfinite(sigma).all(axis=2)
    reach = np.nanmax(measured, axis=(0, 1)) - np.nanmin(measured, axis=(0, 1))
    reach += np.nanmax(sigma, axis=(0, 1))
    time = track["time"].values - track["time"].values[0]
    return _HeldHistory(time, measured, sigma, observed, bias, reach)


def _criterion(seen: _HeldHistory, places: list[int], intervals: int) -> float:
    """Computes Akaike's criterion of all histories with so many intervals."""
    count = 3 * int(seen.observed[:, places].sum())
    unknown = 3 * len(places) * (intervals + _DEGREE)
    misfit = sum(seen.misfit(intervals, place, dof) for place in places for dof in range(3))
    correction = count / max(count - unknown - 1, 1)
    return count * float(np.log(max(misfit / count, _ROUNDING))) + 2 * unknown * correction


def _fit_history(seen: _HeldHistory, intervals: int, place: int, dof: int) -> tuple[Floats, Floats]:
    """Fits values and slopes (1 + n_changes, n_knots) of a history and its independent changes."""
    rows, right_side = seen.equations(intervals, place, dof)
    orthogonal, factor = np.linalg.qr(rows)
    root = np.linalg.inv(factor)
    unknown = np.column_stack([root @ (orthogonal.T @ right_side), root[:, 1:]])
    unknown[0] = 0.0  # the constant is no motion, and the first coefficient is zero
    knots = seen.knots(intervals)
    spline = BSpline(knots, unknown, _DEGREE)
    inner = knots[_DEGREE:-_DEGREE]
    return spline(inner).T, spline.derivative()(inner).T
