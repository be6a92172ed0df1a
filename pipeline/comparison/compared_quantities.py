"""Computes quantities along a recording: rotation, displacement, mimicking, contraction."""

from collections.abc import Callable
from functools import partial
from math import prod
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.comparison.nominal_side import interpolate_response
from pipeline.problem import Problem
from sim.core import Floats, Ints, Mask

TRACKED_QUANTITIES = ("mean_rotation", "mean_displacement", "contraction", "mimicking_error")
"""Names in the dataset."""


class Quantity(NamedTuple):
    """Holds a number that units have together."""

    of: Callable[[Floats], Floats]  # of motions (..., frames, n, 3) in mm and rad: (..., frames)
    units: Ints  # (n,) places of the units that count
    less: Floats | None = None  # (frames, n_units, 3) motion that is taken off theirs first
    over: Floats | None = None  # (instants, n_units) square sizes, whose largest mean divides it
    sampled: bool = True  # whether units stand for others: an interval holds their scatter
    signed: bool = False  # whether it may be below zero; noise makes others larger

    def along(self, motion: Floats, units: Ints) -> Floats:
        """Computes the number (..., frames) of motions (..., frames, n, 3) of units (n,)."""
        apart = motion if self.less is None else motion - self.less[:, units]
        if self.over is None:
            return self.of(apart)
        known = np.asarray(np.isfinite(apart).all(axis=-1))
        return self.of(apart) / largest_size(self.over[:, units], known)


def list_quantities(
    asked: Problem, response: xr.Dataset, time: Floats, seen: Mask
) -> dict[str, Quantity]:
    """Lists the quantities by name; without an intact structure there is nothing to mimic.

    Args:
        asked: the problem.
        response: of all structures under the load case of the recording.
        time: (frames,) of the response at the frames, s; NaN where it has none.
        seen: (n_units,) those that count where they are of interest, held and driven ones too.
    """
    units = np.flatnonzero(seen & (response["roi"].values == 1))
    low, high = (
        [unit for unit in middle_units(asked, side) if seen[unit]] for side in ("bottom", "top")
    )
    nearer, rows = partial(mean_approach, lower=len(low)), np.array([*low, *high])
    found = {
        "mean_rotation": Quantity(mean_rotation, units),
        "mean_displacement": Quantity(mean_displacement, units),
        "contraction": Quantity(nearer, rows, sampled=False, signed=True),
    }
    if "intact" in response["structure"].values:
        intact = response.sel(structure="intact")
        of = partial(root_mean_square, spacing=asked.lattice.spacing)
        motion = intact["displacement"].transpose("time", "unit", "dof").values
        sizes = square_sizes(motion[-1:] if asked.static else motion, asked.lattice.spacing)
        less = interpolate_response(intact, time).displacement
        found["mimicking_error"] = Quantity(of, units, less, sizes)
    return found


def mean_rotation(motion: Floats) -> Floats:
    """Computes the mean |theta|, rad."""
    return known_mean(np.abs(motion[..., 2]))


def mean_displacement(motion: Floats) -> Floats:
    """Computes the mean |u|, mm."""
    return known_mean(np.linalg.norm(motion[..., :2], axis=-1))


def mean_approach(motion: Floats, lower: int) -> Floats:
    """Computes the approach of the first ``lower`` units to the others, which are above, mm."""
    rise = motion[..., 1]
    return known_mean(rise[..., :lower]) - known_mean(rise[..., lower:])


def root_mean_square(motion: Floats, spacing: float) -> Floats:
    """Computes the root mean square of |U|, U = (ux/spacing, uy/spacing, theta)."""
    return np.asarray(np.sqrt(known_mean(square_sizes(motion, spacing))))


def square_sizes(motion: Floats, spacing: float) -> Floats:
    """Computes |U|² of each unit (...) of motions (..., 3)."""
    return np.asarray(np.sum((motion / [spacing, spacing, 1.0]) ** 2, axis=-1))


def largest_size(squares: Floats, known: Mask) -> Floats:
    """Computes the largest root mean square (...) in time over the units that are known.

    Args:
        squares: (instants, n) of each unit.
        known: (..., n) the units that count.
    """
    rows = known.reshape(prod(known.shape[:-1]), known.shape[-1])
    sets, place = np.unique(rows, axis=0, return_inverse=True)
    means = np.array([known_mean(squares[:, each]).max() for each in sets], dtype=float)
    return np.asarray(np.sqrt(means)[place].reshape(known.shape[:-1]))


def middle_units(problem: Problem, side: str) -> list[int]:
    """Selects units of a side in the middle half of the lattice (7 columns of 15)."""
    lattice = problem.lattice
    along = {unit: x for unit, x, _ in lattice.sites()}
    low, high = min(along.values()), max(along.values())
    reach = (high - low + lattice.spacing) / 4
    return [unit for unit in lattice.side(side) if abs(along[unit] - (low + high) / 2) < reach]


def known_mean(values: Floats, axis: int = -1) -> Floats:
    """Computes the mean over an axis of those that are known; NaN of none."""
    known = np.isfinite(values)
    count = known.sum(axis=axis)
    total = np.where(known, values, 0.0).sum(axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
