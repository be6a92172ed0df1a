"""From the YAML of a calibration and its files to a fit."""

from __future__ import annotations

from pathlib import Path

from pipeline.calibration import decay, field, forces
from pipeline.calibration.constants import Constants, start
from pipeline.calibration.description import Calibration, ForceDisplacement, FreeDecay, Set
from pipeline.calibration.estimate import Fit, Model, fit
from pipeline.calibration.experiment import Experiment
from pipeline.errors import UserError
from sim.errors import SimulationError

_ROUNDS = 1
"""In which the effect of the drive's noise is found anew, at better constants."""


def fitted(asked: Calibration, path: Path) -> Fit:
    """The fit that a calibration asks for.

    Args:
        asked: the calibration.
        path: its YAML; files are named as seen from there.

    Raises:
        UserError: a file cannot be used, or the measured states cannot be simulated.
    """
    begin = start(asked)
    experiments = [experiment(each, begin, path) for each in asked.data]
    model = Model(begin, asked.fit, experiments)
    values = sum(len(each.measured.values) for each in experiments)
    if values <= len(model.start):
        remedy = "measure more, or fit fewer constants"
        what = f"{values} values do not determine {len(model.start)} unknowns"
        raise UserError(what, file=path, key="data", remedy=remedy)
    try:
        return settled(model)
    except SimulationError as error:
        raise unsimulated(error, path) from error


def unsimulated(error: SimulationError, path: Path) -> UserError:
    """What it means that measured states cannot be simulated."""
    remedy = "check lattice, displacements and the values in material that the fit starts from"
    what = f"the measured states cannot be simulated: {error}"
    return UserError(what, file=path, key="data", remedy=remedy)


def experiment(asked: Set, begin: Constants, path: Path) -> Experiment:
    """One set as an experiment.

    Raises:
        UserError: its file cannot be used.
    """
    if asked.file is None:
        raise UserError(
            "the data of this set are computed, and have not been yet",
            file=path,
            key=f"data: {asked.name}",
            remedy=f"run python -m pipeline.calibrate synthesise {path} --out-dir FOLDER, and give"
            " the calibration.yaml that it writes",
        )
    folder = path.parent
    if isinstance(asked, ForceDisplacement):
        return forces.experiment(asked, begin, *forces.read(asked, folder))
    if isinstance(asked, FreeDecay):
        return decay.experiment(asked, *decay.read(asked, folder))
    return field.experiment(asked, folder, begin, field.read(asked, folder))


def settled(model: Model) -> Fit:
    """The fit with what the noise of measured drives does at the constants that it finds."""
    known = _noisy(model, model.begin)
    found = fit(known)
    for _ in range(_ROUNDS if known is not model else 0):
        known = _noisy(model, model.constants(found.unknowns))
        found = fit(known, found.unknowns)
    return found


def _noisy(model: Model, at: Constants) -> Model:
    """The model with what the noise of its drives does at some constants, if it has any."""
    if not any(isinstance(each, field.Field) for each in model.experiments):
        return model
    knowing = [
        each.with_drive_noise(at) if isinstance(each, field.Field) else each
        for each in model.experiments
    ]
    return model._replace(experiments=knowing)
