"""Writes a track as a dataset with the names and shapes of a response, and as a plain table."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from pipeline.datasets.tables import TABLES
from pipeline.runtime import write_atomically
from pipeline.tracking.motion import Track
from sim.core import Floats, Mask, Reals

_MOTION = ("time", "unit", "dof")
_NUMBERS = ("ux_mm", "uy_mm", "theta_rad", "sigma_ux_mm", "sigma_uy_mm", "sigma_theta_rad")
_LOADS = ("load_N", "drive_x_mm", "drive_y_mm")


def assemble_track(design: xr.Dataset, track: Track, force: Floats | None = None) -> xr.Dataset:
    """Makes the dataset ``track``: units as in the design, absent ones without motion.

    Args:
        design: as built.
        track: of the units that are present.
        force: (frames,) of the load cell, N.
    """
    present = np.isfinite(design["vertices"].values[:, 0, 0])
    camera, pixel = track.calibration.camera, track.calibration.pixel
    residual = np.full((design.sizes["unit"], 2), np.nan)
    residual[present] = track.calibration.residual
    variables = {
        **pose_variables(present, track.displacement, track.sigma, track.quality),
        "timing": (("time",), track.timing.astype(np.int8)),
        "frame": (("time",), track.frame),
        "load_force": (("time",), np.full(len(track.time), np.nan) if force is None else force),
        "camera_homography": (("row", "column"), camera.homography),
        "camera_centre": (("xy",), camera.centre),
        "camera_radial": (("power",), camera.coefficients),
        "camera_residual": (("unit", "xy"), residual),
        "image_size": (("xy",), np.array(camera.size)),
        "blur": ((), track.calibration.blur / pixel),
    }
    return label_track(design, track.time, variables)


def pose_variables(
    present: Mask, motion: Reals, sigma: Reals, quality: np.ndarray
) -> dict[str, tuple[tuple[str, ...], np.ndarray]]:
    """Spreads poses, uncertainties and quality (frames, present units, ...) over all units."""
    found = {"displacement": (motion, np.nan), "sigma": (sigma, np.nan)}
    return {
        name: (_MOTION[: values.ndim], _over_all_units(values, present, fill))
        for name, (values, fill) in (found | {"quality": (quality, absent_flag())}).items()
    }


def label_track(design: xr.Dataset, time: Floats, variables: Mapping[str, object]) -> xr.Dataset:
    """Variables of a track with the labels of the design's units, and how far these are driven."""
    coordinates = {
        **{name: design[name] for name in ("unit", "i", "j", "xy")},
        "time": (("time",), time),
        "dof": (("dof",), ["ux", "uy", "theta"]),
    }
    made = xr.Dataset({"vertices": design["vertices"], **variables}, coordinates)
    driven = made["displacement"].values[:, driven_units(design), :2]
    return made.assign_coords(drive_displacement=(("time", "xy"), mean_over_seen(driven)))


def driven_units(design: xr.Dataset) -> Mask:
    """Marks the units (units,) of the design that are driven."""
    flag = TABLES["design"]["support"].flags["driven"]
    return np.asarray(design["support"].values == flag)


def mean_over_seen(motion: Floats) -> Floats:
    """Averages (frames, 2) over units (frames, units, 2) that are seen; NaN without."""
    seen = np.isfinite(motion[..., :1])
    total = np.where(seen, motion, 0.0).sum(axis=1)
    return np.where(seen.any(axis=1), total / np.maximum(seen.sum(axis=1), 1), np.nan)


def _over_all_units(values: np.ndarray, present: np.ndarray, fill: float) -> np.ndarray:
    """Spreads values (frames, present units, ...) over all units."""
    if present.all():
        return values
    out = np.full((values.shape[0], len(present), *values.shape[2:]), fill, values.dtype)
    out[:, present] = values
    return out


def absent_flag() -> int:
    """Returns the quality of a unit that the structure does not have."""
    return TABLES["track"]["quality"].flags["absent"]


def write_track_table(track: xr.Dataset, path: Path) -> None:
    """Writes one line a frame and unit, absent units left out; empty where there is no value.

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
