"""Tracks in closed form: what a response does, there and back, with noise, turns and delays."""

from pathlib import Path

import numpy as np
import xarray as xr

from pipeline import datasets
from pipeline.comparison import interpolate_response
from pipeline.tracking.geometry import as_built
from pipeline.tracking.output import label_track

SIGMA = np.array([0.004, 0.004, 0.0008])
PIXEL = 0.25
FORCE = 0.02
"""Noise of the load cell, N."""


def track(
    design: xr.Dataset, response: xr.Dataset, structure: str, time: np.ndarray, at: np.ndarray
) -> xr.Dataset:
    """A track of the first case; frames of times (frames,), s, show the response at others, s."""
    shown = response.sel(structure=structure).isel(case=0)
    true = interpolate_response(shown, at)
    motion = true.displacement
    random = np.random.default_rng(5)
    noise = SIGMA * random.standard_normal(motion.shape)
    built = as_built(design, structure)
    frames, absent = len(time), np.isnan(motion[..., 0])
    variables = {
        "displacement": (("time", "unit", "dof"), motion + noise),
        "sigma": (("time", "unit", "dof"), np.where(np.isnan(motion), np.nan, SIGMA)),
        "quality": (("time", "unit"), np.where(absent, 6, 0).astype(np.int8)),
        "timing": (("time",), np.zeros(frames, np.int8)),
        "frame": (("time",), np.arange(frames)),
        "load_force": (("time",), true.force + FORCE * random.standard_normal(frames)),
        "camera_homography": (("row", "column"), np.diag([1 / PIXEL, 1 / PIXEL, 1.0])),
        "camera_centre": (("xy",), np.zeros(2)),
        "camera_radial": (("power",), np.zeros(2)),
        "camera_residual": (("unit", "xy"), np.where(absent[0], np.nan, np.zeros((2, 1))).T),
        "image_size": (("xy",), np.array([512, 512])),
        "blur": ((), 0.6),
    }
    return label_track(built, time, variables)


def written(made: xr.Dataset, folder: Path, more: str = "") -> list[str]:
    """Writes a track and its recording; returns the options that name them."""
    origin = {"recording": "{}", "synthetic": "yes", "parents": "{}"}
    datasets.write(made, folder / "track.nc", "track", origin)
    text = f"video: a.mp4\npixel_size: {PIXEL} mm\nsynthetic: true\n{more}"
    (folder / "recording.yaml").write_text(text, encoding="utf-8")
    return ["--track", str(folder / "track.nc"), "--recording", str(folder / "recording.yaml")]
