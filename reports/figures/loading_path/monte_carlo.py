"""Describes imperfect copies of the design, in the terms of the report's measure."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.figures.loading_path.measures import Measure, scales, size_of_intact


@dataclass(frozen=True)
class Spread:
    """Holds percentiles of a number over the copies with one kind of noise, and their counts."""

    noise: str
    low: float
    middle: float
    high: float
    count: int
    failed: int
    clashing: int


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


def spreads(values: xr.DataArray, copies: xr.Dataset) -> list[Spread]:
    """Spreads values (noise, sample) of every kind of noise: 5 %, 50 % and 95 % percentiles."""
    found = []
    for noise in copies["noise"].values:
        part = copies.sel(noise=noise)
        good = values.sel(noise=noise).values[(part["status"] == "ok").values]
        low, middle, high = np.percentile(good, (5, 50, 95)) if len(good) else (np.nan,) * 3
        found.append(
            Spread(
                str(noise), float(low), float(middle), float(high),
                len(good), part["sample"].size - len(good), int((part["clashes"] > 0).sum()),
            )
        )  # fmt: skip
    return found
