"""Poses the scene that a design is optimised for, and the loads that it must hold."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.posing.to_scene import motions_of, scene_of
from pipeline.problem import Problem
from pipeline.problem.sections import (
    DisplacementDrive,
    Drive,
    HarmonicDrive,
    Load,
    LoadRanges,
    RampHarmonicDrive,
    SeveralDrives,
    TestSetup,
)
from sim.load_family import LoadFamily, LoadSetup, polar
from sim.scene import DIRECTED, Scene
from sim.solvers import MotionLaw, Superposition
from sim.structure import Perturbation, draw_copies

_ALIKE = ("amplitude", "frequency")
"""Ranges that all set-ups have alike, where they give none of their own."""


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
    setups = [_setup(asked, ranges, folder)]
    for each in ranges.setups:
        given = {name: getattr(each, name) or getattr(ranges, name) for name in _ALIKE}
        posed = asked.in_setup(each)
        made = _setup(posed, each.model_copy(update=given), folder)
        setups.append(replace(made, scene=scene_of(posed, folder)))
    return LoadFamily(tuple(setups))


def _setup(asked: Problem, ranges: LoadRanges | TestSetup, folder: Path) -> LoadSetup:
    """Reads the loads in ranges under a problem's own drive, or two at once."""
    motions = [m for m in motions_of(asked, folder) if isinstance(m, DIRECTED | Superposition)]
    directions, amplitudes = zip(*map(polar, motions), strict=True)
    own = None if asked.frequency is None else (asked.frequency, asked.frequency)
    return LoadSetup(
        motions[0],
        direction=ranges.directions or (min(directions), max(directions)),
        amplitude=ranges.amplitude or (amplitudes[0], amplitudes[0]),
        frequency=ranges.frequency or own,
    )


def greatest_loss(of: xr.Dataset) -> float:
    """Finds the greatest loss of one design, of all that its certificate tried."""
    return max(float(of["loss"].max()), float(of["found_loss"].max()))


def worst_load(certificate: xr.Dataset) -> dict[str, float]:
    """Finds the load of the greatest loss of a design, of all that a certificate tried.

    Its direction is in degrees, its amplitude in mm, its frequency in Hz, NaN where it has none;
    its set-up is numbered, the study's own is the first.
    """
    of = certificate.sel(design="cloaked")
    random = float(of["loss"].max()) == greatest_loss(of)
    kind, loss = ("load", "loss") if random else ("found", "found_loss")
    number = int(np.nanargmax(of[loss].values))
    parts = ("direction", "amplitude", "frequency", "setup")
    return {part: float(of[f"{kind}_{part}"].values[number]) for part in parts}


def under_worst(asked: Problem, certificate: xr.Dataset) -> Problem:
    """Poses a problem under the worst load of its certificate alone."""
    load, ranges = worst_load(certificate), asked.objective.loads
    if (number := int(load["setup"])) and ranges is not None:
        asked = asked.in_setup(ranges.setups[number - 1])
    return asked.model_copy(update={"drive": _along(asked.drive, load)})


def _along(drive: Drive, load: dict[str, float]) -> Drive:
    """Turns a drive along a load, or mixes two by it; in periods it takes as long as before."""
    way, amplitude = float(np.deg2rad(load["direction"])), load["amplitude"]
    if isinstance(drive, SeveralDrives):
        parts = amplitude * np.cos(way), amplitude * np.sin(way)
        mixed = zip(drive.drives, map(float, parts), strict=True)
        drives = tuple(one.model_copy(update={"amplitude": part}) for one, part in mixed)
        return drive.model_copy(update={"drives": drives})
    assert isinstance(drive, DisplacementDrive)
    changed: dict[str, object] = {"directions": (way,), "weights": None, "amplitude": amplitude}
    if isinstance(drive, HarmonicDrive | RampHarmonicDrive):
        changed["frequency"] = load["frequency"]
    if isinstance(drive, RampHarmonicDrive):
        longer = drive.frequency / load["frequency"]
        changed |= {"rise_time": drive.rise_time * longer, "delay": drive.delay * longer}
    return drive.model_copy(update=changed)


def _under(asked: Problem, load: Load) -> Problem:
    assert isinstance(asked.drive, HarmonicDrive | RampHarmonicDrive)
    changed = load.model_dump(include={"amplitude", "frequency"}, exclude_none=True)
    return asked.model_copy(update={"drive": asked.drive.model_copy(update=changed)})
