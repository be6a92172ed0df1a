"""Poses the structure that a track is of, and turns its motion into the design's frame."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline import problem as problems
from pipeline.calibration.inputs import TrackedMotion
from pipeline.comparison import measure_places, register
from pipeline.posing import flat_vertices, scene_of, spread
from pipeline.problem import Problem
from pipeline.problem.sections import STIFFNESSES
from pipeline.runtime import UserError
from pipeline.tracking.output import distinct_frames
from sim.core import Floats
from sim.scene import Scene
from sim.structure import shape

LEAST_FRAMES = 8


class TrackedSpecimen(NamedTuple):
    """Holds a structure of a study."""

    problem: Problem  # of the study
    scene: Scene  # of the structure, under the problem's drives
    stiffness_factors: Floats  # (n_ligaments, 3) factor on axial, shear and bending stiffness

    def vertices(self, track: xr.Dataset, path: Path) -> Floats:
        """Reads the vertices (n_vertices, 2) as built, mm.

        Raises:
            UserError: the track, read from `path`, is of something else.
        """
        if track.sizes["unit"] != self.problem.lattice.n_units:
            remedy = "name the problem of the study that was filmed"
            raise UserError("the track is of another lattice", file=path, key="unit", remedy=remedy)
        built = flat_vertices(self.scene.lattice, track["vertices"])
        if not np.isfinite(built).all():
            remedy = "name the structure that was filmed: intact, altered or cloaked"
            raise UserError("the track lacks units of the structure", file=path, remedy=remedy)
        return built

    def upright(self, track: xr.Dataset, vertices: Floats) -> xr.Dataset:
        """Turns the track into the design's frame; `vertices` (n_vertices, 2) are as built."""
        lattice = self.scene.lattice
        centre = spread(np.asarray(shape(lattice, vertices).centroid), lattice, track.sizes["unit"])
        found = register(centre, measure_places(track, centre))
        seen = track["displacement"].transpose("time", "unit", "dof").values.astype(float)
        return track.assign(displacement=(("time", "unit", "dof"), found.upright(seen)))

    def towards(self, case: int) -> Floats | None:
        """Computes the direction (3,) of a load case, a unit vector; None where it has none."""
        along = getattr(self.problem.drive, "directions", None)
        return None if along is None else np.array([np.cos(along[case]), np.sin(along[case]), 0.0])


def pose_specimen(asked: TrackedMotion, folder: Path) -> TrackedSpecimen:
    """Poses the structure that a set is of.

    Raises:
        UserError: the problem is wrong, or has no such load case.
    """
    path = folder / asked.problem
    problem = problems.load(path, asked.preset)
    scene = scene_of(problem, path.parent)
    if asked.case >= len(scene.loads.motions):
        what = f"the problem has {len(scene.loads.motions)} load cases, numbered from zero"
        remedy = "give the number of one of them"
        raise UserError(what, file=path, key="case", value=asked.case, remedy=remedy)
    if asked.structure == "intact" and scene.objective.reference is not None:
        scene = scene.objective.reference
    made, nominal = scene.structure.material, problem.material
    factors = [getattr(made, name) / getattr(nominal, name) for name in STIFFNESSES]
    each = [np.broadcast_to(factor, scene.lattice.n_ligaments) for factor in factors]
    return TrackedSpecimen(problem, scene, np.stack(each, axis=1))


def read_track(asked: TrackedMotion, folder: Path) -> xr.Dataset:
    """Reads the track of a set, without its duplicate frames.

    Raises:
        UserError: it cannot be read, or is too short.
    """
    assert asked.file is not None
    track = datasets.read(folder / asked.file, "track")
    track = track.isel(time=distinct_frames(track))
    if track.sizes["time"] < LEAST_FRAMES * asked.every:
        what = f"only {len(track['time'][:: asked.every])} frames are taken"
        remedy = f"give a track of {LEAST_FRAMES} frames or more, or a smaller `every`"
        raise UserError(what, file=folder / asked.file, remedy=remedy)
    return track
