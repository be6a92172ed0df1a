"""Accuracy of tracking against frame rate, on videos with known truth."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from benchmarks.harness import Tell
from benchmarks.tracking import plain_opencv
from pipeline.runtime import UserError
from pipeline.tracking.frames import Frame, import_video, read_frames
from pipeline.tracking.geometry import SpecimenOutlines, outlines_of_design
from pipeline.tracking.motion import track_video
from sim.core import Floats, Image, Ints

THINNINGS = (1, 2, 4)
"""Every so manyth frame is kept."""
Follow = Callable[[list[Frame], SpecimenOutlines, float], Floats]


class TruthVideo(NamedTuple):
    """A video with its truth.

    Attributes:
        name, rate: of the video, Hz.
        frames: all of them.
        specimen: what it shows.
        scale: px/mm, roughly.
        truth: (n_frames, n_units, 3) displacement, mm and rad.
    """

    name: str
    rate: float
    frames: list[Frame]
    specimen: SpecimenOutlines
    scale: float
    truth: Floats


def _own(shown: list[Frame], specimen: SpecimenOutlines, scale: float) -> Floats:
    return np.asarray(track_video(iter(shown), specimen, scale).displacement)


def _plainly(shown: list[Frame], specimen: SpecimenOutlines, scale: float) -> Floats:
    images: list[Image] = [frame.image.astype(np.uint8) for frame in shown]
    return plain_opencv.track(iter(images), specimen, scale)


METHODS: dict[str, Follow] = {"own tracker": _own, "plain OpenCV": _plainly}


def measure(folder: Path, tell: Tell) -> xr.Dataset:
    """The dataset ``tracking`` of the videos in a folder, without its attributes.

    Raises:
        UserError: there are none.
    """
    descriptions = sorted(folder.glob("*.yaml"))
    if not descriptions:
        raise UserError("no described videos", file=folder, remedy="give a folder with --videos")
    clips = [clip(path) for path in descriptions]
    shape = (len(clips), len(METHODS), len(THINNINGS))
    error, lost, spent = np.empty((*shape, 3)), np.empty(shape), np.empty(shape)
    for v, one in enumerate(clips):
        for m, (name, method) in enumerate(METHODS.items()):
            for t, thinning in enumerate(THINNINGS):
                error[v, m, t], lost[v, m, t], spent[v, m, t] = followed(one, method, thinning)
            tell(f"{one.name}, {name}: {spent[v, m, 0]:.3g} s a frame")
    rate = np.array([[one.rate / thinning for thinning in THINNINGS] for one in clips])
    dims = ("video", "tracker", "thinning")
    return xr.Dataset(
        {
            "frame_rate": (("video", "thinning"), rate),
            "error": ((*dims, "dof"), error),
            "lost": (dims, lost),
            "cpu_time": (dims, spent),
        },
        {
            "video": [one.name for one in clips],
            "tracker": list(METHODS),
            "thinning": list(THINNINGS),
            "dof": ["ux", "uy", "theta"],
        },
    )


def clip(path: Path) -> TruthVideo:
    """The video of a description."""
    described = import_video.description(path)
    stem = path.stem.removesuffix("_lossless")
    stored = np.load(next(path.parent.glob(f"{stem}*_truth.npz")))
    return TruthVideo(
        path.stem,
        float(described["fps"]),
        list(read_frames(import_video.video_of(path))),
        outlines_of_design(import_video.design(described)),
        float(described["approx_px_per_mm"]),
        displacement(stored, described["grid"][0]),
    )


def displacement(stored: np.lib.npyio.NpzFile, columns: int) -> Floats:
    """True displacement (n_frames, n_units, 3), units in the order i + columns j."""
    if "displacement" in stored:
        return np.asarray(stored["displacement"], dtype=float)
    moved = [stored["x"] - stored["x0"], stored["y"] - stored["y0"], stored["theta"]]
    return np.stack(moved, axis=-1)[:, order(stored, columns)]


def order(stored: np.lib.npyio.NpzFile, columns: int) -> Ints:
    """Places (n_units,) of the units in the stored arrays, in the order i + columns j."""
    return np.argsort(stored["unit_ij"][:, 0] + columns * stored["unit_ij"][:, 1])


def followed(one: TruthVideo, method: Follow, thinning: int) -> tuple[Floats, float, float]:
    """Root mean square errors (3,), share of lost poses, and processor time of a frame, s."""
    shown, truth = one.frames[::thinning], one.truth[::thinning]
    start = time.process_time()
    missed = method(shown, one.specimen, one.scale) - truth
    spent = (time.process_time() - start) / len(shown)
    known = np.isfinite(missed).all(axis=-1)
    return np.sqrt(np.mean(missed[known] ** 2, axis=0)), float(1 - known.mean()), spent
