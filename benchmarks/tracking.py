"""Command line: ``python -m benchmarks.tracking``: accuracy and speed on videos with truth."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.tracking import importing
from pipeline.tracking.arrays import Floats, Mask
from pipeline.tracking.follow import follow
from pipeline.tracking.specimen import of_design
from pipeline.tracking.video import frames

_GROSS = (0.3, 0.3, np.deg2rad(3))


class Truth(NamedTuple):
    """Displacement (frames, units, 3), and which units are to be seen (frames, units)."""

    displacement: Floats
    visible: Mask


def truth(folder: Path, name: str, columns: int) -> Truth:
    """Truth of a video, units in the order i + columns j."""
    stored = np.load(folder / f"{name}_truth.npz")
    order = np.argsort(stored["unit_ij"][:, 0] + columns * stored["unit_ij"][:, 1])
    moved = [stored["x"] - stored["x0"], stored["y"] - stored["y0"], stored["theta"]]
    displacement = np.stack(moved, axis=-1)[:, order]
    markers = stored["marker_visible"][:, order]
    visible = np.ones(displacement.shape[:2], dtype=bool)
    return Truth(displacement, markers.sum(axis=2) >= 2 if markers.shape[2] else visible)


def row(name: str, found: Floats, real: Truth, px_per_mm: float) -> str:
    """A line of the table."""
    error = found - real.displacement
    known = np.isfinite(error).all(axis=-1)
    seen = known & real.visible
    scale = np.array([px_per_mm, px_per_mm, 180 / np.pi])
    rms = np.sqrt(np.mean(error[seen] ** 2, axis=0)) * scale
    bias = np.abs(error[seen].mean(axis=0))[:2].max()
    gross = (np.abs(error[known]) > _GROSS).any(axis=-1).sum()
    lost = 100 * (real.visible & ~known).sum() / real.visible.sum()
    return f"{name:<34}{rms[0]:8.4f}{rms[1]:8.4f}{rms[2]:8.3f}{bias:10.5f}{gross:7d}{lost:8.2f}"


def _measure(video: Path, folder: Path) -> None:
    name = video.stem.removesuffix("_lossless")
    described = importing.description(folder / f"{name}.yaml")
    specimen = of_design(importing.design(described))
    scale = described["approx_px_per_mm"]
    real = truth(folder, name, described["grid"][0])
    images = list(frames(video))
    start = time.process_time()
    track = follow(iter(images), specimen, scale)
    spent = time.process_time() - start
    standard = (track.displacement - real.displacement)[1:] / track.sigma[1:]
    spread = [standard[real.visible[1:], dof] for dof in range(3)]
    told = " ".join(f"{np.nanstd(values):.2f}" for values in spread)
    line = row(video.name, track.displacement, real, 1 / track.calibration.pixel)
    print(f"{line}   {told}   {len(images) / spent:5.1f}", flush=True)


def main() -> int:
    """Prints the table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tracking", description=__doc__)
    parser.add_argument("names", nargs="*", help="videos, by their file names; all by default")
    parser.add_argument("--folder", type=Path, required=True, help="where they are")
    asked = parser.parse_args()
    videos = [path for path in sorted(asked.folder.iterdir()) if path.suffix in (".mp4", ".mkv")]
    print(f"{'RMSE':<34}{'x px':>8}{'y px':>8}{'rot deg':>8}{'bias mm':>10}{'gross':>7}", end="")
    print(f"{'lost %':>8}   error/sigma x y rot   frames/s, whole run")
    for video in videos:
        if not asked.names or video.name in asked.names:
            _measure(video, asked.folder)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
