"""Tests force over displacement of a small lattice: bottom row clamped, top row moved."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pipeline import datasets
from pipeline.calibration.experiments.experiment import ELASTIC, LEAST_LINES, MeasuredValues
from pipeline.calibration.experiments.load_cycles import prepare_record
from pipeline.calibration.experiments.simulated_experiment import Observation, SpecimenSimulation
from pipeline.calibration.inputs import (
    ConstantName,
    Constants,
    ForceColumns,
    ForceDisplacement,
    RecordOptions,
    TestKind,
)
from pipeline.problem.fields import csv_columns, units
from pipeline.problem.sections import Lattice as Specimen
from pipeline.runtime import UserError
from pipeline.tracking.geometry import difference_of_vertices
from pipeline.tracking.output import distinct_frames, grip_displacement
from sim.core import Floats, Ints, Numbers
from sim.energy import topology
from sim.quasistatics import StaticSolver
from sim.scene import strain_energies
from sim.solvers import PrescribedMotion, TimeSeries, held_dofs
from sim.structure import Lattice, Parameters

DIRECTIONS = {"tension": (0.0, 1.0), "compression": (0.0, -1.0), "shear": (1.0, 0.0)}
TOLERANCE = 1e-12
"""Of equilibria, relative: far below what a difference of 1e-4 in a logarithm changes."""


class ForceFile(Protocol):
    """Describes a file of forces: its test and columns, and how a record is cut."""

    @property
    def test(self) -> TestKind: ...  # noqa: D102
    @property
    def file(self) -> str | None: ...  # noqa: D102
    @property
    def columns(self) -> ForceColumns: ...  # noqa: D102
    @property
    def record(self) -> RecordOptions | None: ...  # noqa: D102


def read(
    asked: ForceFile, specimen: Specimen, folder: Path, *, tare: bool = False
) -> tuple[Floats, Floats]:
    """Reads displacements in mm and forces in N from the file of a set.

    Args:
        asked: the set.
        specimen: that it is of.
        folder: from which its file is named.
        tare: whether the load cell's zero is unknown, as the least displacement tells it then.

    Raises:
        UserError: the file cannot be used.
    """
    assert asked.file is not None
    path = folder / asked.file
    if path.suffix == ".nc":
        displacement, force = _read_track(path, specimen, asked.test)
    else:
        wanted = {asked.columns.displacement: units.LENGTH, asked.columns.force: units.FORCE}
        displacement, force = csv_columns.read_quantities(path, wanted, LEAST_LINES).T
    if asked.record is not None:
        try:
            displacement, force = prepare_record(displacement, force, asked.record)
        except ValueError as error:
            remedy = "look at the curve, and change branch, drop_first or toe"
            raise UserError(str(error), file=path, key="record", remedy=remedy) from error
    _check_signs(asked, path, displacement, force - tare * force[np.abs(displacement).argmin()])
    return displacement, force


def _check_signs(asked: ForceFile, path: Path, displacement: Floats, force: Floats) -> None:
    """Refuses a displacement or a force that counts against the test."""
    if not (displacement > 0).any() and (asked.test != "shear" or not displacement.any()):
        raise UserError(
            "the displacement is nowhere above zero",
            file=path,
            key=asked.columns.displacement,
            value=f"down to {displacement.min():g} mm",
            remedy=f"count it positive in {asked.test}, or write record: {{reversed: both}}",
        )
    if force @ displacement <= 0.0:
        far = np.abs(displacement).argmax()
        raise UserError(
            "the force is on the whole not above zero along the displacement",
            file=path,
            key=asked.columns.force,
            value=f"{force[far]:g} N at {displacement[far]:g} mm",
            remedy="count it positive along the displacement, or write record: {reversed: force};"
            " zero: start takes out an offset of the load cell",
        )


def _read_track(path: Path, specimen: Specimen, test: TestKind) -> tuple[Floats, Floats]:
    """Reads how far the top row of a filmed specimen went from the bottom row, and the force."""
    track = datasets.read(path, "track")
    if track.sizes["unit"] != specimen.n_units:
        what = f"the track is of {track.sizes['unit']} units, the lattice of {specimen.n_units}"
        remedy = "describe in lattice the specimen that was filmed"
        raise UserError(what, file=path, key="unit", remedy=remedy)
    tracked, lattice = track["vertices"].values, specimen.network()
    built = lattice.padded(lattice.vertices)
    if tracked.shape == built.shape:  # the origin may be elsewhere
        built = built + np.nanmedian(tracked - built, axis=(0, 1))
    if told := difference_of_vertices(tracked, built):
        raise UserError(
            f"the track is of another specimen than the lattice: {told}",
            file=path,
            key="vertices",
            remedy="describe in lattice the specimen that was filmed: columns, rows, spacing and"
            " bias_angle, which counts the opposite way of a description's bias_angle_deg",
        )
    if not np.isfinite(track["load_force"]).any():
        remedy = "give load_cell in the recording's YAML, and track it again"
        raise UserError("the track has no forces", file=path, key="load_force", remedy=remedy)
    shown = track.isel(time=distinct_frames(track))
    moved = shown["displacement"].transpose("time", "unit", "dof").values
    site = np.array([place for _, *place in specimen.sites()])
    rows = (list(specimen.side(name)) for name in ("top", "bottom"))
    top, bottom = (grip_displacement(moved[:, row], site[row]) for row in rows)
    way = (top - bottom) @ DIRECTIONS[test]
    force = shown["load_force"].values
    seen = np.isfinite(way) & np.isfinite(force)
    return way[seen], force[seen]


@dataclass(frozen=True)
class ForceTest:
    """Holds a test of forces (``experiment.Experiment``)."""

    measured: MeasuredValues
    simulation: SpecimenSimulation
    tare: bool
    depends_on: tuple[ConstantName, ...] = ELASTIC

    @property
    def nuisance_start(self) -> Floats:
        """Computes the load cell's zero, N, if it is unknown."""
        return np.zeros(int(self.tare))

    @property
    def nuisance_scale(self) -> Floats:
        """See ``experiment.Experiment``."""
        return np.full(int(self.tare), float(np.abs(self.measured.values).max()))

    def predict(self, constants: Constants, nuisance: Floats) -> Floats:
        """Predicts forces, see ``experiment.Experiment``."""
        return self.simulation.predict(constants) + nuisance.sum()

    def pull_back(self, constants: Constants, bar: Floats) -> Floats:
        """Differentiates `bar @ predict` by the specimen's numbers (5,), by the adjoint."""
        return self.simulation.pull_back(constants, bar)


def pose_force_test(
    asked: ForceDisplacement, begin: Constants, displacement: Floats, force: Floats
) -> ForceTest:
    """Returns the set as an experiment on equilibria."""
    sigma = np.full(len(force), 1.0 if asked.noise is None else asked.noise)
    known = asked.noise is not None
    measured = MeasuredValues(asked.name, asked.kind, displacement, force, sigma, known)
    return ForceTest(
        measured, pose_simulation(asked.lattice, asked.test, begin, displacement), asked.tare
    )


def pose_simulation(
    specimen: Specimen, test: TestKind, begin: Constants, displacement: Floats
) -> SpecimenSimulation:
    """Poses a specimen at the measured displacements of a test."""
    lattice, contact = specimen.network(), begin.contact
    bottom, top = (np.array(specimen.side(name)) for name in ("bottom", "top"))
    towards = np.array([*DIRECTIONS[test], 0.0])
    steps = np.arange(len(displacement) + 1.0)
    motion = np.concatenate([[0.0], displacement])[:, None] * towards
    fixed = topology(lattice, held_dofs(bottom, top), begin.law)
    return SpecimenSimulation(
        lattice,
        lattice.vertices,
        begin.material.density,
        0.0 if contact is None else contact.stiffness,
        StaticSolver(fixed, steps[1:], relative=TOLERANCE),
        PrescribedMotion(top, TimeSeries(steps, motion)),
        force_on(lattice, top, towards),
    )


def force_on(lattice: Lattice, moved: Ints, towards: Floats) -> Observation:
    """Computes the force (n,) on units along a direction: the slope of energy over their shift.

    Contact acts on rotations alone, so its energy does not change with a displacement.
    """
    pairs = lattice.ligament_units
    chosen = np.flatnonzero(np.isin(pairs, moved).any(axis=1))

    def energy(step: Array, state: Array, made: Parameters) -> Array:
        displaced = state.at[moved].add(step * towards)
        return strain_energies(displaced, made, chosen, pairs[chosen]).sum()

    def forces(motion: Numbers, made: Parameters) -> Array:
        of_all = jax.vmap(jax.grad(energy), in_axes=(None, 0, None))
        return jnp.asarray(of_all(jnp.zeros(()), jnp.asarray(motion), made))

    return forces
