"""Holds recordings of a study beside its simulation, along the same course: time, or the load."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.problem import Problem
from sim.core import Floats

_UNLOADING = 2
_BEYOND = 0.02
"""Share of the course by which a recording may end before it, and still shows its end."""


@dataclass(frozen=True)
class RecordedMotion:
    """Describes one recording."""

    name: str  # of its file
    data: xr.Dataset  # the dataset `comparison`
    # (n_frames,) time in s, or displacement of the driven units along the drive in mm, never
    # falling
    along: Floats
    frames: NDArray[np.int64]  # (n_frames,) the frames that these are, of those in the dataset
    level: float  # part of the imperfect specimens between the limits of a prediction band
    take: int = 0  # number among those of its structure and load case, zero of the only one

    @property
    def structure(self) -> str:
        """Returns the structure that was filmed."""
        return str(self.data.attrs["structure"])

    @property
    def case(self) -> int:
        """Returns the load case that it was under."""
        return int(self.data.attrs["case"])

    @property
    def synthetic(self) -> bool:
        """Tells whether it was rendered."""
        return str(self.data.attrs["synthetic"]) == "yes"

    @property
    def source(self) -> str:
        """Tells what a figure calls it."""
        words = f"experiment ({SYNTHETIC_LABEL})" if self.synthetic else "experiment"
        return f"{words}, take {self.take}" if self.take else words

    def values(self, variable: xr.DataArray) -> Floats:
        """Returns a variable (time, ...) of the dataset at its frames (n_frames, ...)."""
        return variable.transpose("time", ...).values[self.frames]

    def at(self, variable: xr.DataArray, wanted: Floats) -> Floats:
        """Interpolates a variable (time, ...) of the dataset; NaN where nothing was recorded.

        `wanted` is where along the course, in the unit of `along`.
        """
        values = self.values(variable)
        slack = _BEYOND * (float(np.max(wanted)) - float(self.along[0]))
        within = (wanted >= self.along[0] - slack) & (wanted <= self.along[-1] + slack)
        place = np.interp(wanted, self.along, np.arange(len(self.along)))
        low = np.minimum(place.astype(int), len(values) - 2)
        part = (place - low).reshape(-1, *[1] * (values.ndim - 1))
        found = values[low] + part * (values[low + 1] - values[low])
        return np.where(within.reshape(part.shape), found, np.nan)

    def motion(self, response: xr.Dataset, wanted: Floats) -> xr.Dataset:
        """Returns the measured motion in the form of a response of one structure and one case.

        `wanted` is where along the course; these are its `time`.
        """
        part = response.sel(structure=self.structure).isel(case=[self.case], time=slice(0, 0))
        part = part.drop_vars([name for name in part.data_vars if "time" in part[name].dims])
        measured = self.at(self.data["measured"], wanted)[None]
        dims = ("case", "time", "unit", "dof")
        return part.assign_coords(time=wanted).assign(displacement=(dims, measured))


def recordings(
    problem: Problem, response: xr.Dataset, compared: Mapping[str, xr.Dataset]
) -> list[RecordedMotion]:
    """Returns the recordings of a study, in the order of its structures and load cases."""
    found = [_recorded(problem, response, name, data) for name, data in sorted(compared.items())]
    order = [str(name) for name in response["structure"].values]
    ordered = sorted(found, key=lambda each: (order.index(each.structure), each.case))
    kinds = [(each.structure, each.case) for each in ordered]
    return [
        replace(each, take=kinds[: k + 1].count(kind)) if kinds.count(kind) > 1 else each
        for k, (each, kind) in enumerate(zip(ordered, kinds, strict=True))
    ]


def takes(recorded: Sequence[RecordedMotion]) -> Iterator[tuple[int, list[RecordedMotion]]]:
    """Yields the recordings of each take, with its number; an only one is of all of them."""
    for number in sorted({each.take for each in recorded if each.take}) or [0]:
        yield number, [each for each in recorded if each.take in {0, number}]


def _recorded(
    problem: Problem, response: xr.Dataset, name: str, data: xr.Dataset
) -> RecordedMotion:
    along = data["time"].values
    if problem.static:
        angle = np.radians(float(response["direction"][int(data.attrs["case"])]))
        along = data["drive_displacement"].values @ np.array([np.cos(angle), np.sin(angle)])
    kept = np.flatnonzero(np.isfinite(along) & (data["branch"].values != _UNLOADING))
    order = kept[np.argsort(along[kept], kind="stable")]
    return RecordedMotion(name, data, along[order], order, problem.prediction.level)
