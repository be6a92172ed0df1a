"""Describes imperfect copies of the design, in the terms of the report's measure."""

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.figures.loading_path.measures import Measure, over_cases, scales, size_of_intact


def copy_curves(
    problem: Problem, measure: Measure, response: xr.Dataset, copies: xr.Dataset
) -> xr.DataArray:
    """Returns the measure (noise, sample, time) of every copy, NaN where it failed."""
    if measure.key == "rotation":
        return np.degrees(copies["rotation"])  # type: ignore[return-value]
    departure = copies["departure"]
    if measure.key == "mismatch":
        departure = departure / size_of_intact(response, scales(problem), problem.static)
    return over_cases(problem, departure)
