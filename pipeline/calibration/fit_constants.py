"""Fits constants to the sets that the YAML of a calibration names."""

from pathlib import Path

import numpy as np

from pipeline.calibration.experiments import (
    Experiment,
    FullFieldExperiment,
    force_displacement,
    free_decay,
    full_field,
    tracked_specimen,
)
from pipeline.calibration.fit_uncertainty import invert_information
from pipeline.calibration.inputs import (
    Calibration,
    Constants,
    ForceDisplacement,
    FreeDecay,
    MeasurementSet,
    start_constants,
)
from pipeline.calibration.least_squares import Fit, FitModel, fit_least_squares
from pipeline.runtime import UserError
from sim.core import Floats, SimulationError

_ITERATIONS = 5
"""At most, in which the effect of the drive's noise is found anew, at better constants."""
_HALVINGS = 5
"""At most, of the steps in time."""
CONVERGED = 0.2
"""Constants that change by less, in standard errors, are final."""


def fit_calibration(asked: Calibration, path: Path) -> Fit:
    """Fits the constants of a calibration; `path` is its YAML, from which files are named.

    Raises:
        UserError: a file cannot be used, or the measured states cannot be simulated.
    """
    begin = start_constants(asked)
    experiments = [read_experiment(each, begin, path) for each in asked.data]
    model = FitModel(begin, asked.fit, experiments)
    values = sum(len(each.measured.values) for each in experiments)
    if values <= len(model.start):
        remedy = "measure more, or fit fewer constants"
        what = f"{values} values do not determine {len(model.start)} unknowns"
        raise UserError(what, file=path, key="data", remedy=remedy)
    try:
        return fit_converged(model)
    except SimulationError as error:
        raise simulation_fault(error, path) from error


def simulation_fault(error: SimulationError, path: Path) -> UserError:
    """Explains that measured states cannot be simulated."""
    remedy = "check lattice, displacements and the values in material that the fit starts from"
    what = f"the measured states cannot be simulated: {error}"
    return UserError(what, file=path, key="data", remedy=remedy)


def read_experiment(asked: MeasurementSet, begin: Constants, path: Path) -> Experiment:
    """Reads one set as an experiment.

    Raises:
        UserError: its file cannot be used.
    """
    if asked.file is None:
        raise UserError(
            "the data of this set are computed, and have not been yet",
            file=path,
            key=f"data: {asked.name}",
            remedy=f"run python -m pipeline calibrate synthesise {path} --out-dir FOLDER,"
            " give the calibration.yaml that it writes",
        )
    folder = path.parent
    if isinstance(asked, ForceDisplacement):
        readings = force_displacement.read(asked, asked.lattice, folder, tare=asked.tare)
        return force_displacement.pose_force_test(asked, begin, *readings)
    if isinstance(asked, FreeDecay):
        return free_decay.pose_decay(asked, *free_decay.read(asked, folder))
    return full_field.pose_track(asked, folder, begin, tracked_specimen.read_track(asked, folder))


def fit_converged(model: FitModel) -> Fit:
    """Fits with steps in time, and an effect of the drives' noise, that suit the result."""
    if not any(isinstance(each, FullFieldExperiment) for each in model.experiments):
        return fit_least_squares(model)
    found = fit_least_squares(_with_drive_noise(model, model.begin))
    for _ in range(_ITERATIONS):
        before, known = found, _with_drive_noise(found.model, found.model.constants(found.unknowns))
        found = _refine_steps(fit_least_squares(known, before.unknowns))
        if _largest_change(found, found.unknowns - before.unknowns) < CONVERGED:
            break
    return found


def _refine_steps(found: Fit) -> Fit:
    """Fits with steps in time so short that half of them would move no constant."""
    for _ in range(_HALVINGS):
        finer = found.model._replace(
            experiments=[_with_finer_steps(each) for each in found.model.experiments]
        )
        change = finer.residual(found.unknowns) - found.model.residual(found.unknowns)
        level = found.level[found.model.set_of_row]
        shift = -invert_information(found.jacobian) @ (found.jacobian.T @ (change / level))
        if _largest_change(found, shift) < CONVERGED:
            return found
        found = fit_least_squares(finer, found.unknowns)
    return found


def _largest_change(found: Fit, change: Floats) -> float:
    """Computes the largest of the constants' changes, in standard errors."""
    error = np.sqrt(np.diag(invert_information(found.jacobian)))
    return float(np.abs(change / error)[: len(found.model.names)].max())


def _with_drive_noise(model: FitModel, at: Constants) -> FitModel:
    """Adds the effect of the drives' noise at some constants to the model."""
    experiments = [
        each.with_drive_noise(at) if isinstance(each, FullFieldExperiment) else each
        for each in model.experiments
    ]
    return model._replace(experiments=experiments)


def _with_finer_steps(each: Experiment) -> Experiment:
    return each.finer() if isinstance(each, FullFieldExperiment) else each
