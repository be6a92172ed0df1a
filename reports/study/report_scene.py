"""Tells what the figures need to know of a problem, in their own units: mm, s, Hz and degrees."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from pipeline.problem.sections import HarmonicDrive, RampHarmonicDrive
from pipeline.runtime import UserError
from sim.core import Floats


@dataclass(frozen=True)
class ReportScene:
    """Describes a harmonically driven lattice.

    Lengths in mm, times in s, frequencies in Hz, directions in degrees. The loss is taken over
    `horizon`, with `weights` of the load cases; `radii` bound the cloak; `middle` is the lattice's
    centre; `symmetry` is the one imposed on the design.
    """

    title: str
    columns: int
    rows: int
    spacing: float
    amplitude: float
    frequency: float
    directions: tuple[float, ...]
    weights: tuple[float, ...]
    horizon: float
    radii: tuple[float, ...]
    middle: tuple[float, float]
    symmetry: str

    @property
    def period(self) -> float:
        """Returns the period of the drive, s."""
        return 1.0 / self.frequency

    @property
    def scale(self) -> Floats:
        """Finds divisors (3,) that make (ux, uy, theta) dimensionless: U = (ux/s, uy/s, theta)."""
        return np.array([self.spacing, self.spacing, 1.0])

    def mean(self, values: xr.DataArray) -> xr.DataArray:
        """Returns weighted mean over the load cases of values (..., case)."""
        weights = xr.DataArray(np.array(self.weights), dims="case")
        return (values * weights).sum("case") / float(np.sum(self.weights))


def scene_of_problem(problem: Problem) -> ReportScene:
    """Returns scene of a problem.

    Raises:
        UserError: the drive is not harmonic, so there are no cycles to show.
    """
    drive, lattice = problem.drive, problem.lattice
    if not isinstance(drive, HarmonicDrive | RampHarmonicDrive):
        what = "this report is of a harmonic drive"
        remedy = "give kind: harmonic, or take the datasets without this report"
        raise UserError(what, key="drive.kind", value=drive.kind, remedy=remedy)
    _, inner, outer = problem.cloak.bounds or ("centre", 0.0, 0.0)
    return ReportScene(
        title=problem.title,
        columns=lattice.columns,
        rows=lattice.rows,
        spacing=lattice.spacing,
        amplitude=drive.amplitude,
        frequency=drive.frequency,
        directions=tuple(round(float(np.degrees(angle)), 9) for angle in drive.directions),
        weights=drive.case_weights,
        horizon=problem.horizon_time,
        radii=tuple(radius for radius in (inner, outer) if radius > 0),
        middle=lattice.centre_site,
        symmetry=problem.optimiser.symmetry,
    )


def cycles(scene: ReportScene, response: xr.Dataset) -> float:
    """Returns number of drive cycles that a response covers."""
    time = response["time"].values
    return float((time[-1] - time[0]) * scene.frequency)
