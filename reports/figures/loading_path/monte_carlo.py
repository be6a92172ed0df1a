"""Describes imperfect copies of the design, in the terms of the report's measure."""

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr

from pipeline.problem import Problem
from reports.facts import copies as copied
from reports.figures.loading_path.measures import Measure, over_cases, scales, size_of_intact

DRAWN = ("geometry", "stiffness", "together")
"""First words of the noises that have a band and a row; others stand in the tables alone."""


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


def drawn_noises(made: xr.Dataset) -> list[str]:
    """Lists the noises of imperfect copies that are drawn."""
    return [name for name in _names([made]) if _is_drawn(name)]


def noises_in_words(made: Sequence[xr.Dataset]) -> tuple[str, str]:
    """Says which noises of several studies are drawn, and which are left to their tables."""
    names = _names(made)
    drawn, left = (
        ", ".join(copied.in_words(name) for name in names if _is_drawn(name) == wanted)
        for wanted in (True, False)
    )
    return drawn, left


def _names(made: Iterable[xr.Dataset]) -> list[str]:
    return list(dict.fromkeys(str(name) for each in made for name in each["noise"].values))


def _is_drawn(noise: str) -> bool:
    return noise.split(maxsplit=1)[0] in DRAWN
