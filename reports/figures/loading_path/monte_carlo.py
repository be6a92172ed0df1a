"""Describes imperfect copies of the design, in the terms of the report's measure."""

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.figures.loading_path.measures import Measure, scales, size_of_intact


def copy_curves(
    problem: Problem, measure: Measure, response: xr.Dataset, copies: xr.Dataset
) -> xr.DataArray:
    """Returns the measure (noise, sample, time) of every copy, NaN where it failed."""
    if measure.key == "rotation":
        return np.degrees(copies["rotation"])  # type: ignore[return-value]
    if measure.key == "motion":
        return copies["departure"]
    count = int(response["roi"].sum())
    intact = float(size_of_intact(response, scales(problem), problem.static).isel(case=0))
    return copies["departure"] * np.sqrt(count) / intact
