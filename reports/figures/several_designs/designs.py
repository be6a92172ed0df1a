"""Reads the designs of a problem with the parameter that they differ by."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import problem
from pipeline.problem import Problem
from pipeline.problem.sections import SettingValue, design_name, split_value
from pipeline.runtime import UserError
from reports.facts import measures
from reports.study import CLOAK, ReportScene, StudyResults
from reports.study import study_results as study
from sim.core import Floats

RADIUS = "cloak.disc.radius"


@dataclass(frozen=True)
class SeriesDesign:
    """Describes one of the designs: the value of the parameter, in words, and its study."""

    number: int
    word: SettingValue
    study: StudyResults

    @property
    def scene(self) -> ReportScene:
        """Returns the shaken lattice."""
        return self.study.scene

    @property
    def units(self) -> int:
        """Returns number of units in the cloak."""
        return int((self.study.design["region"] == CLOAK).sum())

    @cached_property
    def _reached(self) -> xr.DataArray:
        """Returns largest |U| over the loss's time (structure, case, unit)."""
        scene, moved = self.scene, self.study.response["displacement"]
        window = moved.sel(time=slice(None, scene.horizon * measures.LAST_SAMPLE))
        return measures.magnitude(window, scene.scale).max("time")

    @property
    def peak(self) -> xr.DataArray:
        """Returns largest |U| over the loss's time (structure, unit), mean over the load cases."""
        return self.scene.mean(self._reached)

    @property
    def boundary(self) -> xr.DataArray:
        """Finds the largest |U| of a unit of the outer rows and columns, mean over the cases."""
        i, j = (self.study.response[name].values for name in ("i", "j"))
        scene = self.scene
        outer = np.isin(i, (0, scene.columns - 1)) | np.isin(j, (0, scene.rows - 1))
        return scene.mean(self._reached.isel(unit=outer).max("unit"))

    def loss(self, structure: str) -> float:
        """Returns the loss, mean over the load cases."""
        return float(self.scene.mean(self.study.response["loss"].sel(structure=structure)))


@dataclass(frozen=True)
class DesignSeries:
    """Describes all designs of a problem, in their order.

    `target` builds them; `problem` asks for them; `key` is the parameter that they differ by.
    """

    name: str
    target: str
    problem: Problem
    key: str
    designs: list[SeriesDesign]

    @property
    def axis(self) -> tuple[Floats, str]:
        """Returns values of the parameter and what they are, for an axis; a radius in spacings."""
        found = [split_value(design.word) for design in self.designs]
        values = np.array([number for number, _ in filter(None, found)])
        unit = next((unit for _, unit in filter(None, found)), "")
        if self.key == RADIUS and unit == "mm":
            return values / self.designs[0].scene.spacing, "Size of the cloak $R/s$"
        return values, f"{self.key} ({unit})" if unit else self.key

    def label(self, design: SeriesDesign) -> str:
        """Tells what one design is called beside the others."""
        value = self.axis[0][self.designs.index(design)]
        return f"R = {value:g}s" if self.key == RADIUS else f"{self.key} = {design.word}"


def load(path: Path, preset: str | None, results: Path) -> DesignSeries:
    """Returns all designs with their datasets.

    Raises:
        UserError: the problem asks for one design only, or not for numbers to tell them by, or a
            dataset is missing.
    """
    asked = problem.load(path, preset)
    if asked.designs is None:
        remedy = "list the values of a parameter below `designs`, or make the report of a study"
        raise UserError("the problem asks for one design", file=path, key="designs", remedy=remedy)
    ((key, words),) = asked.designs.items()
    if any(split_value(word) is None for word in words):
        remedy = "vary a parameter that is a number"
        raise UserError("numbers are wanted here", file=path, key=f"designs.{key}", remedy=remedy)
    name = path.resolve().parent.name
    found = []
    for number, word in enumerate(words, start=1):
        one = design_name(preset or "", number)
        folder = results / f"{name}@{one}"
        wanted = problem.outputs(problem.load(path, one))
        files = {kind: folder / f"{kind}.nc" for kind in wanted}
        found.append(SeriesDesign(number, word, study.load(path, one, files)))
    target = name if preset is None else f"{name}@{preset}"
    return DesignSeries(name, target, asked, key, found)
