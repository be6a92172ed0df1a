"""Simulates a structure and imperfect copies of it under the measured motion."""

import logging
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.comparison import redrive, tolerance_band
from pipeline.posing import PosedStructure, spread
from pipeline.problem import Problem
from sim.core import Floats

LOG = logging.getLogger(__name__)


class SimulatedSide(NamedTuple):
    """Holds the response of a structure to the measured motion of its held units."""

    displacement: Floats  # (frames, units, 3) mm and rad; NaN for absent units
    force: Floats  # (frames,) of the drive along its direction, N
    copies: Floats  # (samples, frames, units, 3) of imperfect copies under the same motion
    force_copies: Floats  # (samples, frames) likewise
    failures: tuple[str, ...]  # why the path ended early, and why copies have no simulation


def simulate_specimen(
    asked: Problem,
    structure: PosedStructure,
    track: xr.Dataset,
    times: Floats,
    way: Floats,
    threads: int = 1,
) -> SimulatedSide:
    """Simulates a structure and imperfect copies of it as the specimen was driven.

    The track is in the design's frame; `times` (frames,) are on its clock, s; `way` (2,) is the
    direction of the drive.

    Raises:
        UserError: no driven unit was seen.
    """
    held = redrive.filter_held_motion(track, structure.scene)
    clock = times - track["time"].values[0]
    made = redrive.simulate_redriven(structure, held, clock)
    lattice, size = structure.scene.lattice, track.sizes["unit"]
    displacement = spread(made.displacement, lattice, size, axis=1)
    if made.failure is not None:
        LOG.warning("the simulation ended early: %s", made.failure)
        nothing = np.empty((0, *displacement.shape))
        return SimulatedSide(
            displacement, made.drive_force @ way, nothing, nothing[..., 0, 0], (made.failure,)
        )
    copies = tolerance_band.sample_specimens(asked, structure, clock, held, threads=threads)
    return SimulatedSide(
        displacement,
        made.drive_force @ way,
        spread(copies.displacement, lattice, size, axis=2),
        copies.drive_force @ way,
        copies.failures,
    )
