"""Full-field fit: the motion of every free unit of a track, driven as its held units were."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax import Array

from pipeline import datasets
from pipeline import problem as problems
from pipeline.calibration.constants import Constants
from pipeline.calibration.description import Name, TrackedMotion
from pipeline.calibration.drivenoise import changes
from pipeline.calibration.experiment import ELASTIC, Measured
from pipeline.calibration.simulated import AnySolver, KnownDrive, Simulation
from pipeline.calibration.virtual import Error
from pipeline.comparison import redrive
from pipeline.comparison.registration import measured_places, register
from pipeline.datasets import TABLES
from pipeline.errors import UserError
from pipeline.problem import Problem
from pipeline.scenes import scene_of
from pipeline.structures import flat_vertices, spread
from sim.arrays import Floats, Ints, Numbers
from sim.explicit import ExplicitSolver
from sim.geometry import shape
from sim.implicit import ImplicitSolver
from sim.model import Parameters, topology
from sim.plan import make_plan
from sim.scene import Scene
from sim.statics import StaticSolver

TOLERANCE = 1e-12
"""Of equilibria, relative."""
STAGES = 1e-7
"""Of the stages of a motion in time, mm/s."""
LEAST_FRAMES = 8
UNKNOWN = np.array([0.1, 0.1, np.deg2rad(0.5)])
"""Standard deviation (mm, mm, rad) of what stays with a held unit, where it is not stated."""
DAMPING: tuple[Name, ...] = ("damping_ratio", "damping_translation", "damping_rotation")


class Specimen(NamedTuple):
    """A structure of a study.

    Attributes:
        problem: of the study.
        scene: of the structure, under the problem's drives.
        stiffer: (n_ligaments,) factor on the stiffness of each ligament.
    """

    problem: Problem
    scene: Scene
    stiffer: Floats


@dataclass(frozen=True)
class Field:
    """A track as an experiment (``experiment.Experiment``).

    Attributes:
        measured: displacements of the free units, one course after the other.
        simulation: of the specimen under the measured motion of the held units.
        sees: the constants that the motion depends on.
        drives: that motion changed by one standard deviation of its noise, in independent ways.
    """

    measured: Measured
    simulation: Simulation
    sees: tuple[Name, ...]
    drives: tuple[redrive.Course, ...]

    @property
    def own_start(self) -> Floats:
        """None."""
        return np.zeros(0)

    @property
    def own_scale(self) -> Floats:
        """None."""
        return np.zeros(0)

    def predict(self, constants: Constants, own: Floats) -> Floats:
        """See ``experiment.Experiment``."""
        del own
        return self.simulation.predict(constants)

    def with_drive_noise(self, constants: Constants) -> Field:
        """The same, knowing what the noise of the measured drive does to the prediction."""
        middle = self.simulation.predict(constants)
        causes = [self.simulation.predict(constants, each) - middle for each in self.drives]
        return replace(self, measured=self.measured.with_common(np.stack(causes, axis=1)))


def specimen(asked: TrackedMotion, folder: Path) -> Specimen:
    """The structure that a set is of.

    Raises:
        UserError: the problem is wrong.
    """
    path = folder / asked.problem
    problem = problems.load(path, asked.preset)
    scene = scene_of(problem, path.parent)
    if asked.structure == "intact" and scene.reference is not None:
        scene = scene.reference
    ones = np.ones(scene.lattice.n_ligaments)
    return Specimen(problem, scene, ones * scene.material.axial / problem.material.axial_stiffness)


def read(asked: TrackedMotion, folder: Path) -> xr.Dataset:
    """The track of a set.

    Raises:
        UserError: it cannot be read, or is too short.
    """
    assert asked.file is not None
    track = datasets.read(folder / asked.file, "track")
    if track.sizes["time"] < LEAST_FRAMES * asked.every:
        what = f"only {track.sizes['time']} frames, of which every {asked.every}th is taken"
        remedy = f"give a track of {LEAST_FRAMES} frames or more, or a smaller `every`"
        raise UserError(what, file=folder / asked.file, remedy=remedy)
    return track


def experiment(asked: TrackedMotion, folder: Path, begin: Constants, track: xr.Dataset) -> Field:
    """The set as an experiment.

    Raises:
        UserError: the problem is wrong, or the track is of something else.
    """
    made = specimen(asked, folder)
    lattice, path = made.scene.lattice, folder / str(asked.file)
    if track.sizes["unit"] != made.problem.lattice.n_units:
        remedy = "name the problem of the study that was filmed"
        raise UserError("the track is of another lattice", file=path, key="unit", remedy=remedy)
    vertices = flat_vertices(lattice, track["vertices"])
    if not np.isfinite(vertices).all():
        remedy = "name the structure that was filmed: intact, altered or cloaked"
        raise UserError("the track lacks units of the structure", file=path, remedy=remedy)
    upright = _upright(track, made, vertices)
    bias = UNKNOWN if asked.bias is None else three(asked.bias)
    try:
        held = redrive.held_motion(upright, made.scene)
    except UserError as error:
        error.file = str(path)
        raise
    driven = redrive.under(made.scene, held)
    frames = np.arange(0, track.sizes["time"], asked.every)
    time = (track["time"].values - track["time"].values[0])[frames]
    chosen = _chosen(upright.isel(time=frames), driven)
    unit, dof, frame = chosen.T
    values, sigma = (
        upright[name]
        .transpose("unit", "dof", "time")
        .values.astype(float)[lattice.id[unit], dof, frames[frame]]
        for name in ("displacement", "sigma")
    )
    measured = Measured(
        asked.name,
        asked.kind,
        time[frame],
        values,
        sigma,
        asked.noise == "tracker",
        3 * lattice.id[unit] + dof,
        np.full(len(values), np.inf) if asked.bias is None else bias[dof],
    )

    def seen(motion: Numbers, made: Parameters) -> Array:
        del made
        return jnp.asarray(motion)[frame, unit, dof]

    simulation = Simulation(
        lattice,
        vertices,
        begin.material.density,
        float(np.max(made.scene.material.contact)),
        _solver(driven, vertices, time),
        KnownDrive(held.unit, held.motion),
        seen,
        made.stiffer,
    )
    sees = ELASTIC if driven.static else (*ELASTIC, *DAMPING)
    return Field(measured, simulation, sees, tuple(changes(upright, made.scene, held.motion, bias)))


def three(error: Error) -> Floats:
    """An error of places and rotations for (ux, uy, theta)."""
    return np.array([error.displacement, error.displacement, error.rotation])


def _upright(track: xr.Dataset, made: Specimen, vertices: Floats) -> xr.Dataset:
    """The track turned into the design's frame."""
    lattice = made.scene.lattice
    centre = spread(np.asarray(shape(lattice, vertices).centroid), lattice, track.sizes["unit"])
    found = register(centre, measured_places(track, centre))
    motion = found.upright(
        track["displacement"].transpose("time", "unit", "dof").values.astype(float)
    )
    return track.assign(displacement=(("time", "unit", "dof"), motion))


def _chosen(track: xr.Dataset, driven: Scene) -> Ints:
    """(n, 3) place of the unit, dof, frame of what counts: free, well seen, course by course.

    The first frame is the reference of all others: by definition nothing has moved.
    """
    good = track["quality"].values == TABLES["track"]["quality"].flags["good"]
    motion, sigma = (
        track[name].transpose("time", "unit", "dof").values for name in ("displacement", "sigma")
    )
    counts = np.isfinite(motion) & (sigma > 0) & good[..., None]
    counts[0] = False
    counts = counts[:, driven.lattice.id].transpose(1, 2, 0).copy()
    counts.reshape(-1, counts.shape[2])[driven.held] = False
    return np.argwhere(counts)


def _solver(driven: Scene, vertices: Floats, time: Floats) -> AnySolver:
    """The solver of the motion, differentiable by the constants of every ligament."""
    plan = make_plan(driven, vertices, time, every_case=True)
    whole = topology(
        driven.lattice, driven.held, driven.barrier, driven.cutoff, None, driven.contact_distance
    )
    solver = plan.solver
    if isinstance(solver, StaticSolver):
        return replace(solver, topology=whole, relative=TOLERANCE)
    if isinstance(solver, ImplicitSolver):
        return replace(solver, topology=whole, tolerance=STAGES)
    assert isinstance(solver, ExplicitSolver)
    return replace(solver, topology=whole)
