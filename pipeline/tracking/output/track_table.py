"""A track as a plain table, for those who do not read netCDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.datasets.tables import TABLES
from pipeline.runtime import write_atomically
from sim.core import Floats

_NUMBERS = ("ux_mm", "uy_mm", "theta_rad", "sigma_ux_mm", "sigma_uy_mm", "sigma_theta_rad")
_LOADS = ("load_N", "drive_x_mm", "drive_y_mm")


def write_track_table(track: xr.Dataset, path: Path) -> None:
    """One line a frame and unit, absent units left out; empty where there is no value.

    Raises:
        UserError: the file cannot be written.
    """
    flags = TABLES["track"]["quality"].flags
    names = {value: name for name, value in flags.items()}
    quality, drive = track["quality"].values, track["drive_displacement"].values
    loads = np.column_stack([track["load_force"].values, drive])
    pose, sigma = track["displacement"].values, track["sigma"].values
    labels = [
        f"{unit},{i},{j}"
        for unit, i, j in zip(*(track[name].values for name in ("unit", "i", "j")), strict=True)
    ]
    there = np.flatnonzero((quality != flags["absent"]).any(axis=0))
    with write_atomically(path) as aside, aside.open("w", encoding="utf-8", newline="\n") as file:
        if track.attrs["synthetic"] == "yes":
            file.write("# SYNTHETIC: of a rendered video\n")
        file.write(",".join(["time_s", "unit", "i", "j", *_NUMBERS, *_LOADS, "quality"]) + "\n")
        for frame, time in enumerate(track["time"].values):
            load = _cells(loads[frame])
            numbers = np.concatenate([pose[frame], sigma[frame]], axis=-1)
            for unit in there:
                told = f"{load},{names[int(quality[frame, unit])]}"
                file.write(f"{time:.9g},{labels[unit]},{_cells(numbers[unit])},{told}\n")


def _cells(values: Floats) -> str:
    return ",".join("" if np.isnan(value) else f"{value:.7g}" for value in values)
