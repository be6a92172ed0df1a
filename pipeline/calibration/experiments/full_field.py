"""Fits the motion of every free unit of a track, driven as its held units were."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax import Array

from pipeline.calibration.experiments.experiment import ELASTIC, MeasuredValues
from pipeline.calibration.experiments.load_cell import LoadCellReadings, read_load
from pipeline.calibration.experiments.measured_drive import DriveChange, apply_changes, smooth_drive
from pipeline.calibration.experiments.simulated_experiment import (
    ExperimentSolver,
    Observation,
    SpecimenSimulation,
)
from pipeline.calibration.experiments.tracked_specimen import pose_specimen
from pipeline.calibration.inputs import ConstantName, Constants, PoseError, TrackedMotion
from pipeline.comparison import redrive
from pipeline.datasets.tables import TABLES
from pipeline.runtime import UserError
from sim.core import Floats, Ints, Numbers
from sim.energy import topology
from sim.linalg import FASTEST
from sim.quasistatics import StaticSolver
from sim.scene import TURN_ALLOWANCE, Scene
from sim.solvers import PrescribedMotion
from sim.structure import DistanceContact, Parameters
from sim.time_integration import ImplicitSolver

TOLERANCE = 1e-12
"""Of equilibria, relative."""
STAGE_TOLERANCE = 1e-7
"""Of the stages of a motion in time, mm/s."""
STEPS_PER_KNOT = 2
"""In time, between knots of the drive; more where it matters (``fitting``)."""
DEFAULT_BIAS = np.array([0.1, 0.1, np.deg2rad(0.5)])
"""Standard deviation (mm, mm, rad) of what stays with a held unit, where it is not stated."""
DAMPING: tuple[ConstantName, ...] = ("damping_ratio", "damping_translation", "damping_rotation")
COARSE_WARNING = (
    "the frames are too few for the motion of the drive, so that what is between them may be"
    " missed: film faster, or drive more slowly"
)


@dataclass(frozen=True)
class FullFieldExperiment:
    """Holds a track as an experiment (``experiment.Experiment``)."""

    measured: MeasuredValues  # displacements of the free units, history by history; then the load
    simulation: SpecimenSimulation  # of the specimen under the measured motion of the held units
    depends_on: tuple[ConstantName, ...]  # the constants that the motion depends on
    changes: tuple[DriveChange, ...]  # by one standard deviation of that motion's noise each
    drive: PrescribedMotion | None = None  # with the changes that free units speak for
    # (n,) of these changes on the prediction
    noise_effect: Floats = field(default_factory=lambda: np.zeros(()))

    @property
    def nuisance_start(self) -> Floats:
        """None."""
        return np.zeros(0)

    @property
    def nuisance_scale(self) -> Floats:
        """None."""
        return np.zeros(0)

    def predict(self, constants: Constants, nuisance: Floats) -> Floats:
        """Predicts the motion, see ``experiment.Experiment``."""
        del nuisance
        return self.simulation.predict(constants, self.drive) - self.noise_effect

    def pull_back(self, constants: Constants, bar: Floats) -> Floats:
        """Differentiates `bar @ predict` by the specimen's numbers (5,), by the adjoint."""
        return self.simulation.pull_back(constants, bar, self.drive)

    def pull_back_to_noise(self, constants: Constants, bar: Floats) -> Floats:
        """Computes derivatives (n_changes,) of `bar @ predict` by sizes of the drive's changes."""
        motion = self.simulation.pull_back_to_drive(constants, bar, self.drive)
        assert isinstance(motion, redrive.HermiteMotion)
        value, slope = np.asarray(motion.value), np.asarray(motion.slope)
        return np.array(
            [
                value[:, each.place, each.dof] @ each.value
                + slope[:, each.place, each.dof] @ each.slope
                for each in self.changes
            ]
        )

    def with_drive_noise(self, constants: Constants) -> "FullFieldExperiment":
        """Adds the effect of the measured drive's noise on the prediction.

        That is linearised about the drive that the free units speak for as well, by the noise that
        is known so far: one of a noisy drive would belong to another motion (Gauss and Newton's
        method for constants and drive together, the drive eliminated).
        """
        simulation, filtered = self.simulation, self.simulation.drive.motion
        assert isinstance(filtered, redrive.HermiteMotion)
        size = np.zeros(len(self.changes))
        if len(self.measured.spread):
            size = self.measured.causes(self.measured.values - self.predict(constants, np.zeros(0)))
        units, motion = simulation.drive.units, apply_changes(filtered, self.changes, size)
        drive = PrescribedMotion(units, motion)
        middle = simulation.predict(constants, drive)
        moved = (apply_changes(motion, [each], np.ones(1)) for each in self.changes)
        causes = np.stack(
            [
                simulation.predict(constants, PrescribedMotion(units, each)) - middle
                for each in moved
            ],
            axis=1,
        )
        measured = self.measured.with_common(causes)
        return replace(self, measured=measured, drive=drive, noise_effect=causes @ size)

    def finer(self) -> "FullFieldExperiment":
        """Halves the steps in time; of equilibria there are none."""
        return replace(self, simulation=self.simulation.finer())


def pose_track(
    asked: TrackedMotion, folder: Path, begin: Constants, track: xr.Dataset
) -> FullFieldExperiment:
    """Returns the set as an experiment.

    Raises:
        UserError: the problem is wrong, or the track is of something else.
    """
    made, path = pose_specimen(asked, folder), folder / str(asked.file)
    _refuse_other_contact(made.scene, begin, folder / asked.problem)
    vertices = made.vertices(track, path)
    upright = made.upright(track, vertices)
    bias = DEFAULT_BIAS if asked.bias is None else per_dof(asked.bias)
    try:
        drive = smooth_drive(upright, made.scene, bias)
    except UserError as error:
        error.file = str(path)
        raise
    driven = redrive.drive_as_measured(made.scene, drive.held)
    frames = np.arange(0, track.sizes["time"], asked.every)
    shown = upright.isel(time=frames)
    chosen = _select_values(shown, driven)
    measured, load = _measured_values(asked, shown, driven, chosen), None
    if asked.load is not None:
        load = read_load(asked.load, made, asked.case, shown, path)
        measured = load.append_to(measured)
    simulation = SpecimenSimulation(
        driven.lattice,
        vertices,
        begin.material.density,
        float(np.max(driven.structure.material.contact_stiffness)),
        _make_solver(
            driven, shown["time"].values - track["time"].values[0], len(drive.held.motion.value)
        ),
        PrescribedMotion(drive.held.unit, drive.held.motion),
        _make_observation(chosen, load),
        made.stiffness_factors,
    )
    remarks = (COARSE_WARNING,) if drive.coarse else ()
    depends_on = ELASTIC if driven.loads.static else (*ELASTIC, *DAMPING)
    return FullFieldExperiment(
        replace(measured, remarks=remarks), simulation, depends_on, drive.changes
    )


def per_dof(error: PoseError) -> Floats:
    """Repeats an error of places and rotations for (ux, uy, theta)."""
    return np.array([error.displacement, error.displacement, error.rotation])


def _refuse_other_contact(scene: Scene, begin: Constants, path: Path) -> None:
    """Raises a UserError where the cut-off is wanted of contact that the study has otherwise."""
    if begin.cutoff is None:
        return
    law = scene.structure.contact
    if isinstance(law, DistanceContact) or not np.isclose(
        law.barrier_angle, begin.law.barrier_angle
    ):
        what = "the contact of the problem is not that of which the cut-off is wanted"
        remedy = "give the calibration's contact the law and the barrier_angle of the problem"
        raise UserError(what, file=path, key="contact", remedy=remedy)


def _select_values(track: xr.Dataset, driven: Scene) -> Ints:
    """Selects (n, 3) place of the unit, dof, frame: free, well seen, history by history.

    The first frame is the reference of all others: by definition nothing has moved.
    """
    good = track["quality"].values == TABLES["track"]["quality"].flags["good"]
    motion, sigma = (
        track[name].transpose("time", "unit", "dof").values for name in ("displacement", "sigma")
    )
    counts = np.isfinite(motion) & (sigma > 0) & good[..., None]
    counts[0] = False
    counts = counts[:, driven.lattice.id].transpose(1, 2, 0).copy()
    counts.reshape(-1, counts.shape[2])[driven.loads.held] = False
    return np.argwhere(counts)


def _measured_values(
    asked: TrackedMotion, track: xr.Dataset, driven: Scene, chosen: Ints
) -> MeasuredValues:
    """Selects the values of a track that count, in the design's frame."""
    place, dof, frame = chosen.T
    unit = driven.lattice.id[place]
    values, sigma = (
        track[name].transpose("unit", "dof", "time").values.astype(float)[unit, dof, frame]
        for name in ("displacement", "sigma")
    )
    bias = np.full(3, np.inf) if asked.bias is None else per_dof(asked.bias)
    return MeasuredValues(
        asked.name,
        asked.kind,
        (track["time"].values - track["time"].values[0])[frame],
        values,
        sigma,
        asked.noise == "tracker",
        3 * unit + dof,
        bias[dof],
    )


def _make_observation(chosen: Ints, load: LoadCellReadings | None) -> Observation:
    """Makes the observation of a motion: the displacements that count, and the load, if any."""
    unit, dof, frame = chosen.T

    def observe(motion: Numbers, made: Parameters) -> Array:
        moved = jnp.asarray(motion)
        parts = [] if load is None else [load.force(moved[load.frame], made)]
        return jnp.concatenate([moved[frame, unit, dof], *parts])

    return observe


def _make_solver(driven: Scene, asked: Floats, knots: int) -> ExperimentSolver:
    """Makes the solver of the motion at the times, differentiable by every ligament's constants."""
    whole = topology(driven.lattice, driven.loads.held, driven.structure.contact)
    if driven.loads.static:
        return StaticSolver(whole, asked, relative=TOLERANCE)
    steps = np.linspace(0.0, driven.loads.duration, STEPS_PER_KNOT * (knots - 1) + 1)
    whole = replace(whole, storages=FASTEST)
    return ImplicitSolver(whole, steps, asked, STAGE_TOLERANCE, turn_allowance=TURN_ALLOWANCE)
