"""Reads the load cell of a track: the force of the drive along its direction, at equilibria."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.calibration.experiments.experiment import MeasuredValues
from pipeline.calibration.experiments.force_displacement import force_on
from pipeline.calibration.experiments.simulated_experiment import Observation
from pipeline.calibration.experiments.tracked_specimen import TrackedSpecimen
from pipeline.calibration.inputs import LoadCellOptions
from pipeline.runtime import UserError
from sim.core import Floats, Ints
from sim.structure import DistanceContact


class LoadCellReadings(NamedTuple):
    """Readings of a load cell."""

    frame: Ints  # (n,) in which there are any
    time: Floats  # (n,) of these, s
    value: Floats  # (n,) N
    sigma: float  # standard deviation, N
    tare: bool  # whether the cell's zero is unknown
    force: Observation  # what it reads of motions (n, n_units, 3) of the specimen
    channel: int  # its course, after those of all units

    def append_to(self, motion: MeasuredValues) -> MeasuredValues:
        """Appends the readings to a motion."""
        count = len(self.value)
        return replace(
            motion,
            abscissa=np.append(motion.abscissa, self.time),
            values=np.append(motion.values, self.value),
            sigma=np.append(motion.sigma, np.full(count, self.sigma)),
            channel=np.append(motion.channel, np.full(count, self.channel)),
            bias=np.append(motion.bias, np.full(count, np.inf if self.tare else 0.0)),
        )


def check_load(made: TrackedSpecimen, case: int, path: Path) -> Floats:
    """Returns the direction (3,) of a load cell whose readings can be computed.

    Raises:
        UserError: they cannot; it names `path`, and what they lack.
    """
    scene, towards = made.scene, made.towards(case)
    for wrong, what, remedy in (
        (
            not scene.loads.static,
            "in a motion in time the cell feels the inertia of the grips, too",
            "leave out load: forces count in slow, static motions",
        ),
        (
            isinstance(scene.structure.contact, DistanceContact),
            "the force of contact by the law of distance is not known",
            "leave out load, or use contact of law: angle",
        ),
        (
            towards is None,
            "a drive by a time series does not tell the direction of the cell",
            "leave out load, or name a problem whose drive has directions",
        ),
    ):
        if wrong:
            raise UserError(what, file=path, key="load", remedy=remedy)
    assert towards is not None
    return towards


def read_load(
    asked: LoadCellOptions, made: TrackedSpecimen, case: int, track: xr.Dataset, path: Path
) -> LoadCellReadings:
    """Reads the load cell of a track.

    Raises:
        UserError: there are none, or what they read is not known.
    """
    scene, towards = made.scene, check_load(made, case, path)
    if not np.isfinite(track["load_force"].values).any():
        what = "the track has no readings of a load cell"
        remedy = "leave out load, or track the recording with its log of forces"
        raise UserError(what, file=path, key="load", remedy=remedy)
    value = track["load_force"].values
    frame = np.flatnonzero(np.isfinite(value))
    return LoadCellReadings(
        frame,
        (track["time"].values - track["time"].values[0])[frame],
        value[frame],
        asked.noise,
        asked.tare,
        force_on(scene.lattice, scene.loads.driven, towards),
        3 * track.sizes["unit"] + 2,
    )
