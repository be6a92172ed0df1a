"""Writes a track as a dataset with the names and shapes of a response, and as a plain table."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.datasets.tables import TABLES
from pipeline.runtime import UserError, begins_with, sidecar_path, write_atomically
from pipeline.tracking.motion import Track
from sim.core import Floats, Ints, Mask, Reals

_MOTION = ("time", "unit", "dof")
_NUMBERS = ("ux_mm", "uy_mm", "theta_rad", "sigma_ux_mm", "sigma_uy_mm", "sigma_theta_rad")
_LOADS = ("load_N", "drive_x_mm", "drive_y_mm")
_HEADING = ",".join(["time_s", "unit", "i", "j", *_NUMBERS, *_LOADS, "quality"])


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
    """Labels variables of a track by the design's units, and tells how far these are driven.

    That is the mean over all driven units, whichever of several drives moves them.
    """
    coordinates = {
        **{name: design[name] for name in ("unit", "i", "j", "xy")},
        "time": (("time",), time),
        "dof": (("dof",), ["ux", "uy", "theta"]),
    }
    made = xr.Dataset({"vertices": design["vertices"], **variables}, coordinates)
    drive = drive_displacement(made["displacement"].values, design)
    return made.assign_coords(drive_displacement=(("time", "xy"), drive))


def distinct_frames(track: xr.Dataset) -> Ints:
    """Numbers the frames of a track but for duplicates, which do not show their own instant."""
    duplicate = TABLES["track"]["timing"].flags["duplicate"]
    return np.flatnonzero(track["timing"].values != duplicate)


def driven_units(design: xr.Dataset, leading: Ints | None = None) -> Mask:
    """Marks the units (units,) of the design that are driven.

    Of drives that act at once, those of one alone are if its units are given as `leading`.
    """
    flag = TABLES["design"]["support"].flags["driven"]
    driven = np.asarray(design["support"].values == flag)
    return driven if leading is None else driven & np.isin(design["unit"].values, leading)


def check_drive_axis(design: xr.Dataset, source: Path) -> None:
    """Refuses the displacement of the driven units as an axis where it is not that of one drive.

    Raises:
        UserError: no unit of the design is driven, or several drives act at once; names `source`.
    """
    drives = json.loads(design.attrs["problem"]).get("drive", {}).get("drives", [])
    if not driven_units(design).any():
        remedy = "write `load_axis: time`, or give the design of a study with driven units"
        what = "the design has no driven units"
    elif len(drives) > 1:
        remedy = "write `load_axis: time`"
        what = f"{len(drives)} drives act at once: the mean over all their units is that of none"
    else:
        return
    raise UserError(what, file=source, key="load_axis", value="driven displacement", remedy=remedy)


def drive_displacement(
    displacement: Floats, design: xr.Dataset, leading: Ints | None = None
) -> Floats:
    """Averages displacements (frames, units, 3) over the driven units: (frames, 2), NaN without.

    Which these are: see `driven_units`.
    """
    driven = driven_units(design, leading)
    start = design["vertices"].mean("vertex").transpose("unit", "xy").values[driven]
    return grip_displacement(displacement[:, driven], start)


def grip_displacement(displacement: Floats, start: Floats) -> Floats:
    """Averages displacements (frames, units, 3) of what a grip holds: (frames, 2), NaN without.

    Where some were lost they are placed by the rigid motion of those that are seen: the mean over
    these alone would jump, as a grip is never quite straight. At rest they are at `start`
    (units, 2), mm.
    """
    moved = displacement[..., :2] @ [1.0, 1j]
    place = start @ np.array([1.0, 1j])
    mean = np.array([_mean_of_rigid(each, place) for each in moved])
    return np.stack([mean.real, mean.imag], axis=-1)


def _mean_of_rigid(moved: NDArray[np.complex128], place: NDArray[np.complex128]) -> complex:
    """Averages displacements of units at places, x + iy; of those lost, by a rigid motion."""
    seen = np.isfinite(moved)
    if not seen.any():
        return complex(np.nan, np.nan)
    middle, mean = place[seen].mean(), moved[seen].mean()
    arm = place[seen] - middle
    # z' = mean + t arm, |t| = 1, of least squares
    turn = np.vdot(arm, arm + moved[seen] - mean)
    turn = turn / abs(turn) if abs(turn) > 0.0 else 1.0
    lost = mean + (turn - 1.0) * (place - middle)
    return complex(np.where(seen, moved, lost).mean())


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


def track_table_path(out: Path, *sources: Path) -> Path:
    """Names the table beside a track, which replaces no file but such a table.

    Raises:
        UserError: there is another one of that name, such as a log of forces.
    """
    return sidecar_path(out, *sources, ending=".csv", is_own=begins_with(_HEADING))


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
            file.write(f"# {SYNTHETIC_LABEL}: of a rendered video\n")
        file.write(_HEADING + "\n")
        for frame, time in enumerate(track["time"].values):
            load = _table_cells(loads[frame])
            numbers = np.concatenate([pose[frame], sigma[frame]], axis=-1)
            for unit in there:
                told = f"{load},{names[int(quality[frame, unit])]}"
                file.write(f"{time:.9g},{labels[unit]},{_table_cells(numbers[unit])},{told}\n")


def _table_cells(values: Floats) -> str:
    return ",".join("" if np.isnan(value) else f"{value:.7g}" for value in values)
