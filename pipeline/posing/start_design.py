"""Reads the start of an optimisation: the initial lattice, or a design."""

import logging
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.posing.structure_variables import designed_angles, flat_vertices, of_problem
from pipeline.problem import Problem
from pipeline.runtime import UserError
from sim.core import Floats
from sim.scene import Scene

LOG = logging.getLogger(__name__)

_SAME = 1e-9  # mm
_STARTS = {"study": "study's own", "previous": "previous"}


def _shipped_vector(design: xr.Dataset) -> Floats:
    """Reads the design vector (n_variables,) of a design."""
    history = design.sel({"method": design.attrs["shipped_method"]})
    best = int(history["best_evaluation"])
    return np.asarray(history["design_vector"].isel(evaluation=best).values)


def start_vector(asked: Problem, scene: Scene, path: Path | None, source: Path) -> Floats | None:
    """Reads the design vector (n_variables,) that an optimisation starts from, if it has one.

    `path` is a design, where the problem starts from one; `source` is the problem's file. Of a
    design of another cloak or symmetry it is the closest vector, as far as this one allows.

    Raises:
        UserError: a design is wanted and not given, or given and not wanted, or it is one of other
            units.
    """
    kind = asked.optimiser.start
    wanted = kind != "initial"
    if wanted != (path is not None):
        what = (
            f"the problem starts from the {_STARTS[kind]} design"
            if wanted
            else "a start is not asked for"
        )
        remedy = "give --start results/STUDY/design.nc" if wanted else "leave --start out"
        raise UserError(what, file=source, key="optimiser.start", remedy=remedy)
    if path is None:
        return None
    design = datasets.read(path, "design")
    if not of_problem(asked, design):
        what = f"the {_STARTS[kind]} design is of another lattice or void"
        remedy = "keep lattice and void, or start from the initial lattice"
        raise UserError(what, file=source, key="optimiser.start", value=kind, remedy=remedy)
    return closest_vector(scene, design)


def closest_vector(scene: Scene, design: xr.Dataset) -> Floats:
    """Finds the design vector (n_variables,) of a design, or the closest that a scene allows."""
    there, vector = flat_vertices(scene.lattice, design["vertices"]), _shipped_vector(design)
    if len(vector) != scene.space.n_variables or _distance(scene, vector, there) > _SAME:
        vector = _closest(scene, design, there)
        LOG.info("started %.3g mm off the design", _distance(scene, vector, there))
    return vector


def _closest(scene: Scene, design: xr.Dataset, vertices: Floats) -> Floats:
    """Finds the design vector closest to a design, slots as turned as they are there."""
    lattice, angles = scene.lattice, designed_angles(design)
    shifts = np.zeros((lattice.n_groups, 2))
    shifts[lattice.group] = vertices - lattice.vertices
    return scene.space.project(shifts, None if angles is None else np.nan_to_num(angles))


def _distance(scene: Scene, vector: Floats, vertices: Floats) -> float:
    """Finds how far a vertex of a design vector is from where it is to be, at most."""
    return float(np.abs(np.asarray(scene.space.vertices(vector)) - vertices).max())
