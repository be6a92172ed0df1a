"""A computed track: a study's structure under its own drive, seen with noise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.calibration.constants import Constants
from pipeline.calibration.description import TrackedMotion
from pipeline.calibration.field import Specimen, specimen, three
from pipeline.scenes import lattice_of
from pipeline.structures import network_variables, spread, unit_coordinates
from pipeline.tracking.dataset import absent, labelled
from sim.arrays import Floats
from sim.dynamics import solve_case
from sim.model import Material
from sim.plan import concrete_parameters, make_plan


def track_of(
    asked: TrackedMotion, folder: Path, true: Constants, random: np.random.Generator
) -> xr.Dataset:
    """The dataset `track` of the initial structure of a study, made of the true constants.

    Raises:
        UserError: the problem is wrong.
    """
    assert asked.virtual is not None
    made = specimen(asked, folder)
    count = 1 + int(made.scene.duration * asked.virtual.rate * (1 + 1e-9))
    time = np.arange(count) / asked.virtual.rate
    motion = _motion(made, asked.case, true, time)
    noise = three(asked.virtual.noise)
    bias = np.zeros(3) if asked.virtual.bias is None else three(asked.virtual.bias)
    shape = motion.shape
    motion = motion + noise * random.normal(size=shape) + bias * random.normal(size=shape[1:])
    return _dataset(made, time, motion, np.broadcast_to(noise, shape))


def _motion(made: Specimen, case: int, true: Constants, time: Floats) -> Floats:
    """Motion (n_times, n_units, 3) without noise, on a finer grid than a fit would take."""
    scene = made.scene
    axial, shear, bending, translation, rotation = true.numbers
    constants = Material(
        true.material.density,
        made.stiffer * axial,
        made.stiffer * shear,
        made.stiffer * bending,
        scene.material.contact,
        translation,
        rotation,
    )
    posed = replace(scene, material=constants, reference=None)
    plan = make_plan(posed, scene.lattice.vertices, time, every_case=True)
    values, drive = concrete_parameters(posed, scene.lattice.vertices), scene.drives[case]
    _, _, record = solve_case(plan.solver, values, drive)
    finer = solve_case(plan.solver.refined(record), values, drive)[0]
    return finer.reshape(len(time), scene.lattice.n_units, 3)


def _dataset(made: Specimen, time: Floats, motion: Floats, sigma: Floats) -> xr.Dataset:
    intact, lattice = lattice_of(made.problem), made.scene.lattice
    network = network_variables(made.problem, made.scene)
    vertices = spread(lattice.padded(lattice.vertices), lattice, intact.n_units)
    design = xr.Dataset(
        {"support": network["support"], "vertices": (("unit", "vertex", "xy"), vertices)},
        unit_coordinates(intact),
    )
    moved, told = (
        spread(part, lattice, intact.n_units, axis=1).astype(np.float32) for part in (motion, sigma)
    )
    there = np.isin(intact.id, lattice.id)
    quality = np.broadcast_to(np.where(there, 0, absent()), (len(time), intact.n_units))
    nothing = np.full(len(time), np.nan)
    variables = {
        "displacement": (("time", "unit", "dof"), moved),
        "sigma": (("time", "unit", "dof"), told),
        "quality": (("time", "unit"), quality.astype(np.int8)),
        "timing": (("time",), np.zeros(len(time), np.int8)),
        "frame": (("time",), np.arange(len(time))),
        "load_force": (("time",), nothing),
        "camera_homography": (("row", "column"), np.full((3, 3), np.nan)),
        "camera_centre": (("xy",), np.full(2, np.nan)),
        "camera_radial": (("power",), np.full(2, np.nan)),
        "camera_residual": (("unit", "xy"), np.full((intact.n_units, 2), np.nan)),
        "image_size": (("xy",), np.zeros(2, np.int64)),
        "blur": ((), np.nan),
    }
    return labelled(design, time, variables)
