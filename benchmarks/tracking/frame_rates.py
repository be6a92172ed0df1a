"""Measures accuracy of tracking against frame rate, on videos with known truth."""

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from benchmarks.harness import MeasuringLimits, Tell
from benchmarks.tracking import known_patches, plain_opencv, speed, wild_clips
from pipeline.runtime import UserError
from pipeline.tracking.frames import Frame, import_video, read_frames
from pipeline.tracking.geometry import SpecimenOutlines, outlines_of_design
from pipeline.tracking.motion import Track, track_video
from sim.core import Floats, Image, Ints, Mask

THINNINGS = (1, 2, 4)
"""Every so manyth frame is kept."""
METHODS = ("own tracker", "plain OpenCV")
HEAD = (
    f"{'RMSE':<38}{'x px':>8}{'y px':>8}{'rot deg':>8}{'bias mm':>10}{'gross':>7}{'lost %':>8}"
    "   error/sigma x y rot, rank; faults, false; first frame, s; frames/s after it; none decoded"
)
_WARM_UP = 3
"""Frames that compiled loops are loaded with first."""
_GROSS_ERROR = (0.3, 0.3, np.deg2rad(3))
"""Errors from which a pose is grossly wrong, mm and rad."""


class TruthVideo(NamedTuple):
    """Holds a video with its truth."""

    name: str  # of the video
    rate: float  # Hz
    frames: list[Frame]  # all of them
    specimen: SpecimenOutlines  # what it shows
    scale: float  # px/mm, roughly
    truth: Floats  # (n_frames, n_units, 3) displacement, mm and rad
    visible: Mask  # (n_frames, n_units) units that are to be seen
    fault: Mask  # (n_frames,) whether frames before are missing, or the one before is shown again


def measure(folder: Path, limits: MeasuringLimits, tell: Tell) -> xr.Dataset:
    """Returns the dataset ``tracking`` of the videos in a folder, without its attributes.

    Tells of them line by line; then come tables of clips as labs film them, rendered here, and of
    patches whose motions are known.

    Raises:
        UserError: there are none.
    """
    del limits
    videos = [path for path in sorted(folder.iterdir()) if path.suffix in (".mp4", ".mkv")]
    if not videos:
        raise UserError("no described videos", file=folder, remedy="give a folder with --videos")
    clips = [clip(path) for path in videos]
    shape = (len(clips), len(METHODS), len(THINNINGS))
    error, lost, spent = np.empty((*shape, 3)), np.empty(shape), np.empty(shape)
    tell(HEAD)
    for place in np.ndindex(shape):
        one, method, thinning = clips[place[0]], METHODS[place[1]], THINNINGS[place[2]]
        shown, truth = one.frames[::thinning], one.truth[::thinning]
        if thinning == THINNINGS[0]:
            track_timed(one, shown[:_WARM_UP], method)
        found = track_timed(one, shown, method)
        spent[place] = found.each
        missed = found.displacement - truth
        known = np.isfinite(missed).all(axis=-1)
        error[place] = np.sqrt(np.mean(missed[known] ** 2, axis=0))
        lost[place] = 1 - known.mean()
        if thinning == 1:
            tell(f"{one.name:<24}{method:<14}{found.line()}")
    with tempfile.TemporaryDirectory() as made:
        for row in wild_clips.table(Path(made)):
            tell(row)
        tell(speed.table(Path(made)))
    tell(known_patches.table())
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


def clip(video: Path) -> TruthVideo:
    """Reads a video, its description and its truth."""
    stem = video.stem.removesuffix("_lossless")
    described = import_video.description(
        next(
            path
            for path in (video.with_suffix(".yaml"), video.with_name(f"{stem}.yaml"))
            if path.exists()
        )
    )
    stored, columns = np.load(next(video.parent.glob(f"{stem}*_truth.npz"))), described["grid"][0]
    truth = displacement(stored, columns)
    visible, fault = np.ones(truth.shape[:2], dtype=bool), np.zeros(len(truth), dtype=bool)
    if "marker_visible" in stored and stored["marker_visible"].shape[2]:
        visible = stored["marker_visible"][:, order(stored, columns)].sum(axis=2) >= 2
    if "frame_source" in stored:
        source = stored["frame_source"]
        fault = np.diff(source, prepend=source[0] - 1) != 1
    return TruthVideo(
        video.stem,
        float(described["fps"]),
        list(read_frames(video)),
        outlines_of_design(import_video.design(described)),
        float(described["approx_px_per_mm"]),
        truth,
        visible,
        fault,
    )


def displacement(stored: np.lib.npyio.NpzFile, columns: int) -> Floats:
    """Returns the true displacement (n_frames, n_units, 3), units in the order i + columns j."""
    if "displacement" in stored:
        return np.asarray(stored["displacement"], dtype=float)
    moved = [stored["x"] - stored["x0"], stored["y"] - stored["y0"], stored["theta"]]
    return np.stack(moved, axis=-1)[:, order(stored, columns)]


def order(stored: np.lib.npyio.NpzFile, columns: int) -> Ints:
    """Returns the places (n_units,) of the units in stored arrays, in the order i + columns j."""
    return np.argsort(stored["unit_ij"][:, 0] + columns * stored["unit_ij"][:, 1])


class TimedTrack(NamedTuple):
    """Holds where a method saw the units of a video, and the processor time that it took."""

    displacement: Floats  # (n_frames, n_units, 3)
    first: float  # s, to what follows the first frame
    each: float  # s, of a frame from then on
    line: Callable[[], str]  # of the table, of a video with all of its frames


def track_timed(one: TruthVideo, shown: list[Frame], method: str) -> TimedTrack:
    """Tracks frames; the time that decoding takes is not counted."""
    clock = [time.process_time()]

    def tell() -> None:
        clock.append(time.process_time())

    if method == "plain OpenCV":
        track, scale = None, one.scale
        found = plain_opencv.track(_count_frames(shown, tell), one.specimen, scale)
    else:
        track = track_video(iter(shown), one.specimen, one.scale, tell)
        found, scale = np.asarray(track.displacement), 1 / track.calibration.pixel
    first, rest = clock[1] - clock[0], time.process_time() - clock[1]
    each = rest / (len(shown) - 1)

    def line() -> str:
        stated = "" if track is None else sigma_calibration(track, one)
        return f"{accuracy(found, one, scale)}{stated:<49}{first:6.2f}{1 / each:10.1f}"

    return TimedTrack(found, first, each, line)


def _count_frames(shown: list[Frame], tell: Callable[[], None]) -> Iterator[Image]:
    """Yields the pictures of frames, and tells when each of them is done with."""
    for frame in shown:
        yield frame.image.astype(np.uint8)
        tell()


def accuracy(found: Floats, real: TruthVideo, px_per_mm: float) -> str:
    """Formats root mean square errors, bias, gross errors and losses."""
    error = found - real.truth
    known = np.isfinite(error).all(axis=-1)
    seen = known & real.visible
    scale = np.array([px_per_mm, px_per_mm, 180 / np.pi])
    rms = np.sqrt(np.mean(error[seen] ** 2, axis=0)) * scale
    bias = np.abs(error[seen].mean(axis=0))[:2].max()
    gross = (np.abs(error[known]) > _GROSS_ERROR).any(axis=-1).sum()
    lost = 100 * (real.visible & ~known).sum() / real.visible.sum()
    return f"{rms[0]:8.4f}{rms[1]:8.4f}{rms[2]:8.3f}{bias:10.5f}{gross:7d}{lost:8.2f}"


def sigma_calibration(track: Track, real: TruthVideo) -> str:
    """Formats spread of error over sigma, their least rank correlation, faults found and false."""
    from scipy.stats import spearmanr

    seen = real.visible & np.isfinite(track.displacement).all(axis=-1)
    seen[0] = False
    error, sigma = (track.displacement - real.truth)[seen], track.sigma[seen]
    spread = " ".join(f"{value:.2f}" for value in (error / sigma).std(axis=0))
    rank = min(spearmanr(np.abs(error[:, dof]), sigma[:, dof]).statistic for dof in range(3))
    flagged = track.timing != 0
    right, wrong = int((flagged & real.fault).sum()), int((flagged & ~real.fault).sum())
    return f"   {spread}{rank:7.2f}   {right} of {int(real.fault.sum())}, {wrong}"
