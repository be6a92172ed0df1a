"""Simulates a study's structure under its own drive, and adds a tracker's noise."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.calibration.experiments import TrackedSpecimen, load_cell, per_dof, pose_specimen
from pipeline.calibration.inputs import Constants, TrackedMotion
from pipeline.posing import lattice_of, network_variables, spread, unit_coordinates
from pipeline.tracking.output import absent_flag, label_track
from sim.core import Floats
from sim.energy import observe
from sim.scene import Scene, concrete_parameters, simulate
from sim.structure import Material, VoidAngleContact


def simulate_track(
    asked: TrackedMotion, folder: Path, true: Constants, random: np.random.Generator
) -> xr.Dataset:
    """Simulates the `track` of a study's initial structure, made of the true constants.

    Raises:
        UserError: the problem is wrong.
    """
    assert asked.virtual is not None
    made = pose_specimen(asked, folder)
    count = 1 + int(made.scene.loads.duration * asked.virtual.rate * (1 + 1e-9))
    time = np.arange(count) / asked.virtual.rate
    posed = _true_scene(made, true)
    motion = _motion(posed, asked.case, time)
    force = np.full(count, np.nan)
    if asked.virtual.load is not None:
        clean = _force(made, posed, asked, motion, folder)
        force = clean + asked.virtual.load * random.normal(size=count)
    noise = per_dof(asked.virtual.noise)
    bias = np.zeros(3) if asked.virtual.bias is None else per_dof(asked.virtual.bias)
    shape = motion.shape
    motion = motion + noise * random.normal(size=shape) + bias * random.normal(size=shape[1:])
    return _dataset(made, time, motion, np.broadcast_to(noise, shape), force)


def _true_scene(made: TrackedSpecimen, true: Constants) -> Scene:
    """Poses the scene made of the true constants, to be simulated much finer than in a fit."""
    scene = made.scene
    axial, shear, bending, translation, rotation = true.numbers
    constants = Material(
        true.material.density,
        made.stiffness_factors[:, 0] * axial,
        made.stiffness_factors[:, 1] * shear,
        made.stiffness_factors[:, 2] * bending,
        scene.structure.material.contact_stiffness,
        translation,
        rotation,
    )
    law = scene.structure.contact
    if true.cutoff is not None and isinstance(law, VoidAngleContact):
        law = replace(law, cutoff_angle=true.cutoff)
    return scene.updated(material=constants, contact=law, reference=None, accuracy="tight")


def _motion(posed: Scene, case: int, time: Floats) -> Floats:
    """Motion (n_times, n_units, 3) without noise."""
    response = simulate(posed, vertices=posed.lattice.vertices, times=time, cases=[case])
    return np.asarray(response.refined().displacement[0])


def _force(
    made: TrackedSpecimen, posed: Scene, asked: TrackedMotion, motion: Floats, folder: Path
) -> Floats:
    """Computes the force (n_times,) of the drive along its direction at equilibria, N."""
    towards = load_cell.check_load(made, asked.case, folder / asked.problem)
    values = concrete_parameters(posed, posed.lattice.vertices)
    seen = observe(posed.topology, values, motion)
    return np.asarray(seen.force_on(posed.loads.driven) @ towards[:2])


def _dataset(
    made: TrackedSpecimen, time: Floats, motion: Floats, sigma: Floats, force: Floats
) -> xr.Dataset:
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
    quality = np.broadcast_to(np.where(there, 0, absent_flag()), (len(time), intact.n_units))
    variables = {
        "displacement": (("time", "unit", "dof"), moved),
        "sigma": (("time", "unit", "dof"), told),
        "quality": (("time", "unit"), quality.astype(np.int8)),
        "timing": (("time",), np.zeros(len(time), np.int8)),
        "frame": (("time",), np.arange(len(time))),
        "load_force": (("time",), force),
        "camera_homography": (("row", "column"), np.full((3, 3), np.nan)),
        "camera_centre": (("xy",), np.full(2, np.nan)),
        "camera_radial": (("power",), np.full(2, np.nan)),
        "camera_residual": (("unit", "xy"), np.full((intact.n_units, 2), np.nan)),
        "image_size": (("xy",), np.zeros(2, np.int64)),
        "blur": ((), np.nan),
    }
    return label_track(design, time, variables)
