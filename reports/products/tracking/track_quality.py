"""Tells what a track and its video say about the quality of a recording."""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.datasets.tables import TABLES
from pipeline.tracking.frames import open_video
from reports.products.tracking.overlay import of_track
from sim.core import Floats, Image

QUALITY = TABLES["track"]["quality"].flags
TIMING = TABLES["track"]["timing"].flags

_RESTING = 2.5
"""A frame shows the specimen at rest if its units are so many uncertainties from the first's."""
_LEAST = 4
_SAMPLES = 12
_WHITE = 234


class ExposureStatistics(NamedTuple):
    """Describes the brightness of some frames."""

    bright: float  # the 99th percentile, of the range
    dark: float  # the first percentile, of the range
    clipped: float  # part of the pixels at the end of the range
    flicker: float  # standard deviation of the mean brightness over the frames, relative


class StreamProperties(NamedTuple):
    """States how the file holds its frames: the codec's name, and the part standing alone."""

    codec: str
    alone: float


class TrackQuality(NamedTuple):
    """Describes everything that page and advice are made of."""

    pixel: float  # size in the specimen's plane, mm
    pitch: float  # distance of joined units as seen, px
    blur: float  # standard deviation of the blur at edges, px
    sigma: Floats  # (3,) median stated uncertainty: x, y in px, rotation in deg
    resting: int  # number of frames at rest in the beginning
    floor: Floats  # (3,) scatter over these, likewise; NaN if there are too few
    lost: Floats  # (frames, reasons) part of the units that are missing, by reason
    reasons: tuple[str, ...]  # their names
    duplicates: list[int]  # numbers of the frames
    dropped: list[int]  # likewise of those before which some are missing, one a gap
    fastest: float  # largest step of a unit from frame to frame, px
    irregular: float  # spread of the frames' intervals, relative to their median
    residual: float  # root mean square of the first frame's residuals, px
    light: ExposureStatistics  # of the video
    stream: StreamProperties  # of the video


def measured(track: xr.Dataset, images: Iterable[Image], stream: StreamProperties) -> TrackQuality:
    """Measures a track: `images` are frames of its video, `stream` tells how that holds them."""
    pose = track["displacement"].transpose("time", "unit", "dof").values
    sigma = track["sigma"].transpose("time", "unit", "dof").values
    specimen = of_track(track)
    pixel = pixel_size(track)
    scale = np.array([1 / pixel, 1 / pixel, 180 / np.pi])
    resting = _rest_length(pose, sigma)
    timing = track["timing"].values
    interval, rate = np.diff(track["time"].values), frame_rate(track)
    steps = np.linalg.norm(np.diff(pose[..., :2], axis=0), axis=-1) / pixel
    there = np.isin(track["unit"].values, specimen.ids)
    quality = track["quality"].values[:, there]
    missing = {name: flag for name, flag in QUALITY.items() if name not in ("good", "absent")}
    residual = track["camera_residual"].values
    return TrackQuality(
        pixel,
        _spacing(specimen.centre) / pixel,
        float(track["blur"]),
        np.nanmedian(sigma * scale, axis=(0, 1)),
        resting,
        _floor(pose[:resting] * scale) if resting >= _LEAST else np.full(3, np.nan),
        np.stack([(quality == flag).mean(axis=1) for flag in missing.values()], axis=1),
        tuple(missing),
        track["frame"].values[timing == TIMING["duplicate"]].tolist(),
        track["frame"].values[timing == TIMING["dropped"]].tolist(),
        float(np.nanmax(steps, initial=0.0)),
        float(np.ptp(interval) * rate) if rate else 0.0,
        float(np.sqrt(np.nanmean(residual**2))),
        _light(images),
        stream,
    )


def frame_rate(track: xr.Dataset) -> float:
    """Computes the usual number of frames in a second; zero where times do not tell."""
    interval = np.diff(track["time"].values)
    usual = float(np.median(interval)) if len(interval) else 0.0
    return 1 / usual if usual > 0 else 0.0


def pixel_size(track: xr.Dataset) -> float:
    """Returns size of a pixel in the middle of the specimen's plane, mm, without distortion."""
    h = track["camera_homography"].values
    x, y = of_track(track).centre.mean(axis=0)
    depth = h[2] @ np.array([x, y, 1.0])
    return float(np.sqrt(np.abs(depth**3 / np.linalg.det(h))))


def stream_of(video: Path) -> StreamProperties:
    """Reads the codec of a video, and how many frames stand alone; pictures have none."""
    if video.is_dir():
        return StreamProperties("pictures", 1.0)
    with open_video(video) as container:
        stream = container.streams.video[0]
        alone = [packet.is_keyframe for packet in container.demux(stream) if packet.size]
        return StreamProperties(
            stream.codec_context.name, float(Fraction(sum(alone), max(len(alone), 1)))
        )


def sampled(track: xr.Dataset) -> set[int]:
    """Returns numbers of the frames whose brightness is looked at."""
    count = track.sizes["time"]
    chosen = np.unique(np.linspace(0, count - 1, min(count, _SAMPLES)).astype(int))
    return set(track["frame"].values[chosen].tolist())


def _spacing(centre: Floats) -> float:
    """Returns median distance of the nearest neighbour, mm."""
    apart = np.linalg.norm(centre[:, None] - centre[None], axis=-1)
    np.fill_diagonal(apart, np.inf)
    return float(np.median(apart.min(axis=1)))


def _rest_length(pose: Floats, sigma: Floats) -> int:
    """Returns length of the run of frames in the beginning that show no motion."""
    square = (pose / np.maximum(sigma, 1e-12)) ** 2
    with np.errstate(invalid="ignore"):  # nothing is seen in some frames
        away = np.sqrt(np.nansum(square, axis=(1, 2)) / np.isfinite(square).sum(axis=(1, 2)))
    moving = np.flatnonzero(~(away < _RESTING))
    moving = moving[moving > 0]
    return int(moving[0]) if len(moving) else len(pose)


def _floor(pose: Floats) -> Floats:
    """Returns scatter (3,) of units at rest about their own means."""
    known = np.isfinite(pose).all(axis=(0, 2))
    return np.asarray(np.sqrt(np.mean(np.var(pose[:, known], axis=0, ddof=1), axis=0)))


def _light(images: Iterable[Image]) -> ExposureStatistics:
    rows = [
        (*np.percentile(image, [99, 1]) / 255, _clipped(image), image.mean()) for image in images
    ]
    table = np.array(rows)
    bright, dark, clipped, mean = table.mean(axis=0)
    return ExposureStatistics(
        float(bright), float(dark), float(clipped), float(table[:, 3].std() / mean)
    )


def _clipped(image: Image) -> float:
    """Returns part of the pixels at the end of the range, which in a video may be 235."""
    top = image.max()
    return float((image == top).mean()) if top >= _WHITE else 0.0
