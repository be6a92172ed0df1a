"""The log of a load cell at the drive of what is filmed."""

from __future__ import annotations

import numpy as np
import xarray as xr

from pipeline.problem.sections import VirtualLoadCell, VirtualRecording
from pipeline.virtual_lab.filmed_motion import film_clock
from sim.core import Floats

STREAM = 3
"""First word of the seed of the noise: no frame has it."""


def load_cell_log(one: xr.Dataset, asked: VirtualRecording, cell: VirtualLoadCell) -> Floats:
    """Times and forces (lines, 2) of a load cell, on its own clock: s, N.

    A force is positive where the drive pushes along its direction. The log begins at zero of its
    clock and ends a little after the video.

    Args:
        one: a response at one structure and one case, or a specimen.
        asked: the set-up of the video.
        cell: the load cell.

    Raises:
        UserError: the video shows nothing of the response.
    """
    angle = np.deg2rad(float(one["direction"]))
    given = one["time"].values
    force = one["drive_force"].transpose("time", "xy").values @ [np.cos(angle), np.sin(angle)]
    of_video = film_clock(given, asked)
    length = cell.offset + of_video.frames / asked.rate
    time = np.arange(int(np.ceil(length * cell.rate)) + 1) / cell.rate
    pushed = np.interp(of_video.shown(time - cell.offset), given, force)
    random = np.random.default_rng([STREAM, asked.seed])
    return np.column_stack([time, pushed + cell.noise * random.standard_normal(len(time))])
