"""How the noise of a measured drive moves what is simulated under it.

The drive is filtered by a cubic spline (`pipeline.comparison.redrive`). Its knots given, the
coefficients are linear in the measured values, so that their covariance is known: each column of
its root is a change of the drive by one standard deviation, independent of all others.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr
from scipy.interpolate import BSpline

from pipeline.comparison import redrive
from sim.arrays import Floats
from sim.scene import Scene

_DEGREE = 3


def changes(
    track: xr.Dataset, scene: Scene, motion: redrive.Course, bias: Floats
) -> Iterator[redrive.Course]:
    """Drives that differ from the filtered one by one standard deviation, in independent ways.

    Args:
        track: of the specimen.
        scene: of the structure under its planned drive.
        motion: the filtered drive of all held units.
        bias: (3,) standard deviation of what stays with a unit through all frames.
    """
    unit, _ = redrive.held_units(scene)
    seen = track.sel(unit=scene.lattice.id[unit])
    measured, sigma = (
        seen[name].transpose("time", "unit", "dof").values.astype(float)
        for name in ("displacement", "sigma")
    )
    time = track["time"].values - track["time"].values[0]
    there = np.isfinite(measured).all(axis=2) & np.isfinite(sigma).all(axis=2)
    for place, dof in np.ndindex(len(unit), 3):
        kept = there[:, place]
        if kept.sum() < redrive.LEAST_SEEN:
            continue
        course = measured[kept, place, dof], sigma[kept, place, dof]
        for value, slope in zip(*_deviations(time[kept], *course, motion), strict=True):
            yield _changed(motion, place, dof, value, slope)
        yield _changed(motion, place, dof, bias[dof], np.zeros(()))


def _deviations(
    time: Floats, measured: Floats, sigma: Floats, motion: redrive.Course
) -> tuple[Floats, Floats]:
    """Independent deviations of one filtered course: values and slopes (n_coefficients, n)."""
    inner = redrive.filtered(time, measured, sigma).get_knots()
    knots = np.concatenate([[inner[0]] * _DEGREE, inner, [inner[-1]] * _DEGREE])
    basis = BSpline.design_matrix(time, knots, _DEGREE).toarray()
    factor = np.asarray(np.linalg.qr(basis / sigma[:, None], mode="r"))
    shapes = BSpline(knots, np.linalg.inv(factor), _DEGREE)
    instants = np.clip(motion.step * np.arange(len(motion.value)), knots[0], knots[-1])
    return shapes(instants).T, shapes.derivative()(instants).T


def _changed(
    motion: redrive.Course, place: int, dof: int, value: Floats, slope: Floats
) -> redrive.Course:
    moved, steeper = (np.array(part) for part in (motion.value, motion.slope))
    moved[:, place, dof] += value
    steeper[:, place, dof] += slope
    return motion._replace(value=moved, slope=steeper)
