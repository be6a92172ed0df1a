"""Reads the start of an optimisation: the initial lattice, or a design."""

from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.posing.structure_variables import flat_vertices
from pipeline.posing.to_scene import lattice_of
from pipeline.problem import Problem
from pipeline.runtime import UserError
from sim.core import Floats
from sim.scene import Scene

_SAME = 1e-9  # mm


def shipped_vector(design: xr.Dataset) -> Floats:
    """Reads the design vector (n_variables,) of a design."""
    history = design.sel({"method": design.attrs["shipped_method"]})
    best = int(history["best_evaluation"])
    return np.asarray(history["design_vector"].isel(evaluation=best).values)


def start_vector(asked: Problem, scene: Scene, path: Path | None, source: Path) -> Floats | None:
    """Reads the design vector (n_variables,) that an optimisation starts from, if it has one.

    `path` is a design, where the problem starts from one; `source` is the problem's file.

    Raises:
        UserError: a design is wanted and not given, or given and not wanted, or it is one of other
            units or another symmetry.
    """
    wanted = asked.optimiser.start == "study"
    if wanted != (path is not None):
        what = (
            "the problem starts from the study's own design"
            if wanted
            else "a start is not asked for"
        )
        remedy = "give --start results/STUDY/design.nc" if wanted else "leave --start out"
        raise UserError(what, file=source, key="optimiser.start", remedy=remedy)
    if path is None:
        return None
    design = datasets.read(path, "design")
    vector, space = shipped_vector(design), scene.space
    if len(vector) == space.n_variables and design.sizes["unit"] == lattice_of(asked).n_units:
        there = flat_vertices(scene.lattice, design["vertices"])
        if np.abs(np.asarray(space.vertices(vector)) - there).max() < _SAME:
            return vector
    what = "the study's own design has other variables than this one"
    remedy = "keep lattice, void, cloak and symmetry, or start from the initial lattice"
    raise UserError(what, file=source, key="optimiser.start", value="study", remedy=remedy)
