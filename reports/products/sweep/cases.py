"""Describes the cases of a sweep as a picture shows them: along axes of numbers or of words."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.problem.sections import Sweep
from sim.core import Floats


@dataclass(frozen=True)
class SweepAxis:
    """Describes a parameter of a sweep."""

    label: str  # its keys and unit
    places: Floats  # (case) its values; those of words are their numbers in `words`
    words: tuple[str, ...] = ()  # the values, where they are no numbers

    @property
    def distinct(self) -> Floats:
        """Returns every value once, ascending."""
        return np.unique(self.places)


def axes(data: xr.Dataset) -> list[SweepAxis]:
    """Returns the parameters of a sweep, in its order."""
    return [_axis(data.sel(parameter=key)) for key in data["parameter"].values]


def _axis(data: xr.Dataset) -> SweepAxis:
    key, unit = str(data["parameter"].values), str(data["parameter_units"].values)
    values = data["value"].values
    if np.isfinite(values).all():
        return SweepAxis(key if unit == "1" else f"{key} ({unit})", values)
    words, numbers = np.unique(data["setting"].values, return_inverse=True)
    return SweepAxis(key, numbers.astype(float), tuple(map(str, words)))


def ordered(sweep: Sweep) -> bool:
    """Tells whether the cases are points of a curve, one beside the other."""
    return sweep.random is None and len(sweep.keys) == 1


def mapped(sweep: Sweep) -> bool:
    """Tells whether the cases are the points of a map: all combinations of two parameters."""
    return sweep.grid is not None and len(sweep.keys) == 2


def good(data: xr.Dataset) -> NDArray[np.bool_]:
    """Returns (case) whether a case has results."""
    return (data["status"] == "ok").values


def ratio(data: xr.Dataset) -> Floats:
    """Divides (case) loss of the cloaked by that of the altered structure; NaN where failed."""
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient: Floats = (data["loss"] / data["loss_altered"]).values
    return np.where(np.isfinite(quotient), quotient, np.nan)


def failures(data: xr.Dataset) -> list[tuple[str, int]]:
    """Tells why cases failed, and how many for each reason, the most frequent first."""
    reasons, counts = np.unique(data["status"].values[~good(data)], return_counts=True)
    found = [(str(reason), int(count)) for reason, count in zip(reasons, counts, strict=True)]
    return sorted(found, key=lambda entry: -entry[1])
