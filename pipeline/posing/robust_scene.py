"""Poses the scene that a design is optimised for, and the loads that it must hold."""

from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.posing.to_scene import motions_of, scene_of
from pipeline.problem import Problem
from pipeline.problem.sections import DisplacementDrive, HarmonicDrive, Load, RampHarmonicDrive
from sim.load_family import LoadFamily
from sim.scene import DIRECTED, Scene
from sim.solvers import MotionLaw
from sim.structure import Perturbation, draw_copies


def design_scene(asked: Problem, folder: Path) -> Scene:
    """Poses the scene whose loss a design is to lower; the drive's own cases come first.

    Raises:
        UserError: the file of a measured drive cannot be read.
    """
    robust, scene = asked.objective.robust, scene_of(asked, folder)
    if asked.objective.reaction is not None:
        scene = scene.updated(reaction=asked.objective.reaction)
    if robust is None:
        return scene
    if robust.copies:
        sizes = Perturbation(robust.geometry * scene.lattice.spacing, robust.stiffness)
        copies = draw_copies(scene.lattice, sizes, robust.copies, robust.seed)
        scene = scene.updated(copies=copies, copy_sharpness=robust.copy_sharpness)
    scene = scene.updated(sharpness=robust.sharpness)
    if not robust.loads:
        return scene
    loads = (Load(), *robust.loads)
    every = [_under(asked, load) for load in loads]
    motions: tuple[MotionLaw, ...] = tuple(m for each in every for m in motions_of(each, folder))
    frequency = max(each.frequency for each in every if each.frequency is not None)
    share = np.array([load.weight for load in loads])
    weights = np.outer(share / share.sum(), scene.loads.case_weights).ravel()
    return scene.under(motions, scene.loads.duration, frequency).updated(weights=weights)


def load_family(asked: Problem, folder: Path) -> LoadFamily | None:
    """Builds the family of loads that a design must hold, if it is asked for.

    Raises:
        UserError: the file of a measured drive cannot be read.
    """
    ranges = asked.objective.loads
    if ranges is None:
        return None
    motions = [motion for motion in motions_of(asked, folder) if isinstance(motion, DIRECTED)]
    directions = [float(motion.direction) for motion in motions]
    amplitude = float(motions[0].amplitude)
    own = None if asked.frequency is None else (asked.frequency, asked.frequency)
    return LoadFamily(
        motions[0],
        direction=ranges.directions or (min(directions), max(directions)),
        amplitude=ranges.amplitude or (amplitude, amplitude),
        frequency=ranges.frequency or own,
    )


def worst_load(certificate: xr.Dataset) -> dict[str, float]:
    """Finds the load of the greatest loss of a design, of all that a certificate tried.

    Its direction is in degrees, its amplitude in mm, its frequency in Hz, NaN where it has none.
    """
    of = certificate.sel(design="cloaked")
    random, found = (float(of[name].max()) for name in ("loss", "found_loss"))
    kind, loss = ("load", "loss") if random > found else ("found", "found_loss")
    number = int(np.nanargmax(of[loss].values))
    parts = ("direction", "amplitude", "frequency")
    return {part: float(of[f"{kind}_{part}"].values[number]) for part in parts}


def under_worst(asked: Problem, certificate: xr.Dataset) -> Problem:
    """Poses a problem under the worst load of its certificate alone."""
    assert isinstance(asked.drive, DisplacementDrive)
    load = worst_load(certificate)
    changed: dict[str, object] = {"directions": (float(np.deg2rad(load["direction"])),)}
    changed |= {"weights": None, "amplitude": load["amplitude"]}
    if np.isfinite(load["frequency"]):
        changed["frequency"] = load["frequency"]
    return asked.model_copy(update={"drive": asked.drive.model_copy(update=changed)})


def _under(asked: Problem, load: Load) -> Problem:
    assert isinstance(asked.drive, HarmonicDrive | RampHarmonicDrive)
    changed = load.model_dump(include={"amplitude", "frequency"}, exclude_none=True)
    return asked.model_copy(update={"drive": asked.drive.model_copy(update=changed)})
