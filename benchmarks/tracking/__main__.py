"""Command line: ``python -m benchmarks.tracking``: accuracy and speed on videos with truth."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import spearmanr

from benchmarks.tracking import frame_rates, plain_opencv
from pipeline.tracking.frames import import_video, read_frames
from pipeline.tracking.geometry import outlines_of_design
from pipeline.tracking.motion import Track, track_video
from sim.core import Floats, Mask, Reals

_GROSS = (0.3, 0.3, np.deg2rad(3))


class Truth(NamedTuple):
    """What a video shows.

    Attributes:
        displacement: (frames, units, 3) mm and rad.
        visible: (frames, units) which units are to be seen.
        fault: (frames,) whether frames before are missing, or the one before is shown again.
    """

    displacement: Floats
    visible: Mask
    fault: Mask


def truth(folder: Path, name: str, columns: int) -> Truth:
    """Truth of a video, units in the order i + columns j."""
    stored = np.load(folder / f"{name}_truth.npz")
    displacement = frame_rates.displacement(stored, columns)
    markers = stored["marker_visible"][:, frame_rates.order(stored, columns)]
    visible = np.ones(displacement.shape[:2], dtype=bool)
    source = stored["frame_source"]
    fault = np.diff(source, prepend=source[0] - 1) != 1
    return Truth(displacement, markers.sum(axis=2) >= 2 if markers.shape[2] else visible, fault)


def accuracy(found: Reals, real: Truth, px_per_mm: float) -> str:
    """Root mean square errors, bias, gross errors and losses of a line of the table."""
    error = found - real.displacement
    known = np.isfinite(error).all(axis=-1)
    seen = known & real.visible
    scale = np.array([px_per_mm, px_per_mm, 180 / np.pi])
    rms = np.sqrt(np.mean(error[seen] ** 2, axis=0)) * scale
    bias = np.abs(error[seen].mean(axis=0))[:2].max()
    gross = (np.abs(error[known]) > _GROSS).any(axis=-1).sum()
    lost = 100 * (real.visible & ~known).sum() / real.visible.sum()
    return f"{rms[0]:8.4f}{rms[1]:8.4f}{rms[2]:8.3f}{bias:10.5f}{gross:7d}{lost:8.2f}"


def honesty(track: Track, real: Truth) -> str:
    """Spread of error over sigma, least rank correlation of the two, faults found and false."""
    seen = real.visible & np.isfinite(track.displacement).all(axis=-1)
    seen[0] = False
    error, sigma = (track.displacement - real.displacement)[seen], track.sigma[seen]
    spread = (error / sigma).std(axis=0)
    rank = [spearmanr(np.abs(error[:, dof]), sigma[:, dof]).statistic for dof in range(3)]
    flagged = track.timing != 0
    right, wrong = int((flagged & real.fault).sum()), int((flagged & ~real.fault).sum())
    told = " ".join(f"{value:.2f}" for value in spread)
    return f"   {told}{min(rank):7.2f}   {right} of {int(real.fault.sum())}, {wrong}"


def _measure(video: Path, folder: Path, plainly: bool) -> None:
    name = video.stem.removesuffix("_lossless")
    described = import_video.description(folder / f"{name}.yaml")
    specimen = outlines_of_design(import_video.design(described))
    scale = described["approx_px_per_mm"]
    real = truth(folder, name, described["grid"][0])
    images = list(read_frames(video))
    clock: list[float] = []
    track = track_video(iter(images), specimen, scale, lambda: clock.append(time.process_time()))
    rate = (len(clock) - 1) / (clock[-1] - clock[0])
    line = accuracy(track.displacement, real, 1 / track.calibration.pixel) + honesty(track, real)
    print(f"{video.name:<24}{line}{rate:10.1f}", flush=True)
    if plainly:
        start = time.process_time()
        found = plain_opencv.track(
            (frame.image.astype(np.uint8) for frame in images), specimen, scale
        )
        rate = len(images) / (time.process_time() - start)
        nothing = " " * len(honesty(track, real))
        print(f"{'  plain OpenCV':<24}{accuracy(found, real, scale)}{nothing}{rate:10.1f}")


def main() -> int:
    """Prints the table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tracking", description=__doc__)
    parser.add_argument("names", nargs="*", help="videos, by their file names; all by default")
    parser.add_argument("--folder", type=Path, required=True, help="where they are")
    parser.add_argument("--no-baseline", action="store_true", help="leave plain OpenCV out")
    asked = parser.parse_args()
    videos = [path for path in sorted(asked.folder.iterdir()) if path.suffix in (".mp4", ".mkv")]
    print(f"{'RMSE':<24}{'x px':>8}{'y px':>8}{'rot deg':>8}{'bias mm':>10}{'gross':>7}", end="")
    print(f"{'lost %':>8}   error/sigma x y rot, rank; faults, false; frames/s without decoding")
    for video in videos:
        if not asked.names or video.name in asked.names:
            _measure(video, asked.folder, not asked.no_baseline)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
