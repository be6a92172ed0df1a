"""A track as a plain table, for those who do not read netCDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.datasets import TABLES
from pipeline.whole import whole

_NUMBERS = ("ux_mm", "uy_mm", "theta_rad", "sigma_ux_mm", "sigma_uy_mm", "sigma_theta_rad")


def write(track: xr.Dataset, path: Path) -> None:
    """One line a frame and unit, absent units left out; empty where there is no value.

    Raises:
        UserError: the file cannot be written.
    """
    flags = TABLES["track"]["quality"].flags
    names = {value: name for name, value in flags.items()}
    quality, forces = track["quality"].values, track["load_force"].values
    numbers = np.concatenate([track["displacement"].values, track["sigma"].values], axis=-1)
    labels = [
        f"{unit},{i},{j}"
        for unit, i, j in zip(*(track[name].values for name in ("unit", "i", "j")), strict=True)
    ]
    there = np.flatnonzero((quality != flags["absent"]).any(axis=0))
    with whole(path) as aside, aside.open("w", encoding="utf-8", newline="\n") as file:
        if track.attrs["synthetic"] == "yes":
            file.write("# SYNTHETIC: of a rendered video\n")
        file.write(",".join(["time_s", "unit", "i", "j", *_NUMBERS, "load_N", "quality"]) + "\n")
        for frame, time in enumerate(track["time"].values):
            for unit in there:
                values = ",".join(_cell(value) for value in numbers[frame, unit])
                told = f"{_cell(forces[frame])},{names[int(quality[frame, unit])]}"
                file.write(f"{time:.9g},{labels[unit]},{values},{told}\n")


def _cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.7g}"
