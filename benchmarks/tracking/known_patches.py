"""Measures patches of photographs and of DIC Challenge images whose motions are known.

Every patch is found unaided, then fitted by the tracker's correlation and, from the same start, by
OpenCV's pyramidal optical flow.
"""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from pipeline.calibration import moved_parts, read_picture
from pipeline.calibration.inputs import KnownPictures
from pipeline.problem.reading import load_section
from pipeline.tracking.geometry import rigid_motion, rotation_matrix
from pipeline.tracking.motion import Patch, find_motion, fit_motion
from sim.core import Floats

IMAGES = Path("tests/data/tracking/dic")
PICTURES = Path("experiments/validation/pictures.yaml")
_HALF, _STEP = 20, 4
"""Half a side of a square patch, and step of the flow's points, px."""


class KnownPatch(NamedTuple):
    """Holds a patch, and how it moved.

    Attributes:
        group: of patches, which a line of the table tells of.
        patch: the patch.
        motion: (3,) px and rad, as `find_motion` has them.
        whole: whether it is fitted to its very edge.
    """

    group: str
    patch: Patch
    motion: Floats
    whole: bool = False


def patches(folder: Path = IMAGES, pictures: Path = PICTURES) -> Iterator[KnownPatch]:
    """Yields the patches of all images."""
    with (folder / "truth.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["set"] == "part"]
    for row in rows:
        numbers = np.array(row["patch"].removeprefix("polygon ").split(), float).reshape(-1, 2)
        motion = np.array([row["u_px"], row["v_px"], row["rotation_rad"]], float)
        after = read_picture(folder / f"{Path(row['image']).stem}.png")
        patch = Patch(read_picture(folder / "pc_ref.png"), after, numbers, np.array([250.0, 250.0]))
        yield KnownPatch("part, steps of 30 deg", patch, motion)
    before, after = (read_picture(folder / f"rotation_{turn}.png") for turn in ("000", "170"))
    turn = np.deg2rad(-170.0)
    for x, y in ((256, 256), (200, 180), (320, 200), (190, 330), (330, 310)):
        there = np.array([x, y], float)
        shift = rotation_matrix(turn) @ (there - 256) + 256 - there
        patch = Patch(before, after, _square(x, y), there)
        yield KnownPatch("pair turned by 170 deg", patch, np.append(shift, turn))
    names = ("Reference", "P200_K50_N2")
    before, after = (read_picture(folder / f"challenge15_{name}.png") for name in names)
    for rows_, v in (((60, 110), -9.57125), ((850, 910), 0.0)):
        for y in rows_:
            for x in range(60, 560, 60):
                patch = Patch(before, after, _square(x, y), np.array([x, y], float))
                yield KnownPatch("DIC Challenge 15", patch, np.array([0.0, v, 0.0]))
    parts = load_section(pictures, KnownPictures).rigid_parts
    for each in moved_parts(parts, pictures.parent):
        group = f"escapement, {parts.parts[each.part].name}, against DICe"
        yield KnownPatch(group, each.patch, each.reference, whole=True)


def _square(x: float, y: float) -> Floats:
    return np.array([x, y]) + _HALF * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])


def flowed(patch: Patch, start: Floats) -> Floats:
    """Fits the motion (3,) to points that OpenCV's pyramidal Lucas-Kanade follows."""
    low, high = patch.outline.min(axis=0), patch.outline.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0], high[0], _STEP), np.arange(low[1], high[1], _STEP))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    shape = patch.outline.astype(np.float32)
    points = points[[cv2.pointPolygonTest(shape, one.tolist(), False) > 0 for one in points]]
    about = points - patch.centre
    guess = patch.centre + start[:2] + about @ rotation_matrix(start[2]).T
    found, good, _ = cv2.calcOpticalFlowPyrLK(
        patch.before,
        patch.after,
        points.astype(np.float32),
        guess.astype(np.float32),
        winSize=(21, 21),
        maxLevel=2,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    kept = good.ravel() > 0
    if kept.sum() < 3:
        return np.full(3, np.nan)
    turn, shift = rigid_motion(about[kept], found[kept] - patch.centre)
    return np.append(shift, turn)


def table(folder: Path = IMAGES) -> str:
    """Measures all patches; returns the lines of their table: mean and spread of the errors."""
    errors: dict[str, list[tuple[Floats, Floats]]] = {}
    for known in patches(folder):
        patch, start = known.patch, find_motion(known.patch)
        both = [np.full(3, np.nan), np.full(3, np.nan)]
        if start is not None:
            both[0] = fit_motion(patch, start, whole=known.whole) - known.motion
            both[1] = flowed(patch, start) - known.motion
        for error in both:
            error[2] = np.angle(np.exp(1j * error[2]))
        errors.setdefault(known.group, []).append((both[0], both[1]))
    lines = [
        "| patches | found | own: bias x, y px; deg | spread x, y px; deg |"
        " optical flow: bias x, y px; deg | spread x, y px; deg |",
        "|---|---|---|---|---|---|",
    ]
    for group, found in errors.items():
        measured = np.array(found)
        seen = np.isfinite(measured[:, 0, 0])
        own, flow = (_cells(measured[seen, method]) for method in range(2))
        lines.append(f"| {group} | {seen.sum()} of {len(seen)} | {own} | {flow} |")
    return "\n".join(lines)


def _cells(error: Floats) -> str:
    bias, spread = np.nanmean(error, axis=0), np.nanstd(error, axis=0)
    return " | ".join(f"{x:.4f}, {y:.4f}; {np.rad2deg(turn):.3f}" for x, y, turn in (bias, spread))
