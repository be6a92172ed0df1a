"""Measures patches of photographs and of DIC Challenge images whose motions are known.

Every patch is found unaided, then fitted by the tracker's correlation and, from the same start, by
OpenCV's pyramidal optical flow. pyvale correlates the same pictures by itself, from where they move
least, in an environment of its own.
"""

import csv
import logging
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from pipeline.calibration import tracked_parts
from pipeline.calibration.inputs import KnownPictures
from pipeline.problem.reading import load_section
from pipeline.tracking.frames import read_pictures
from pipeline.tracking.geometry import rigid_motion, rotation_matrix
from pipeline.tracking.motion import Patch, find_motion, fit_motion
from sim.core import Floats

LOG = logging.getLogger("pipeline.benchmarks")

PYVALE = Path(".cache/pyvale/bin/python")
"""Environment that `make bench-tracking` makes."""
IMAGES = Path("tests/data/tracking/dic")
PICTURES = Path("experiments/validation/pictures.yaml")
_HALF, _STEP = 20, 4
"""Half a side of a square patch, and step of the flow's points, px."""


class KnownPatch(NamedTuple):
    """Holds a patch, and how it moved."""

    group: str  # of patches, which a line of the table tells of
    patch: Patch  # the patch
    motion: Floats  # (3,) px and rad, as `find_motion` has them
    whole: bool = False  # whether it is fitted to its very edge


def patches(folder: Path = IMAGES, pictures: Path = PICTURES) -> Iterator[KnownPatch]:
    """Yields the patches of all images."""
    with (folder / "truth.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["set"] == "part"]
    for row in rows:
        numbers = np.array(row["patch"].removeprefix("polygon ").split(), float).reshape(-1, 2)
        motion = np.array([row["u_px"], row["v_px"], row["rotation_rad"]], float)
        names = "pc_ref", Path(row["image"]).stem
        before, after = read_pictures(*(folder / f"{name}.png" for name in names))
        patch = Patch(before, after, numbers, np.array([250.0, 250.0]))
        yield KnownPatch("part, steps of 30 deg", patch, motion)
    before, after = read_pictures(*(folder / f"rotation_{turn}.png" for turn in ("000", "170")))
    turn = np.deg2rad(-170.0)
    for x, y in ((256, 256), (200, 180), (320, 200), (190, 330), (330, 310)):
        there = np.array([x, y], float)
        shift = rotation_matrix(turn) @ (there - 256) + 256 - there
        patch = Patch(before, after, _square(x, y), there)
        yield KnownPatch("pair turned by 170 deg", patch, np.append(shift, turn))
    names = ("Reference", "P200_K50_N2")
    before, after = read_pictures(*(folder / f"challenge15_{name}.png" for name in names))
    for rows_, v in (((60, 110), -9.57125), ((850, 910), 0.0)):
        for y in rows_:
            for x in range(60, 560, 60):
                patch = Patch(before, after, _square(x, y), np.array([x, y], float))
                yield KnownPatch("DIC Challenge 15", patch, np.array([0.0, v, 0.0]))
    parts = load_section(pictures, KnownPictures).rigid_parts
    for each in tracked_parts(parts, pictures.parent):
        group = f"escapement, {parts.parts[each.part].name}, against DICe"
        yield KnownPatch(group, each.patch, each.reference, whole=True)


def _square(x: float, y: float) -> Floats:
    return np.array([x, y]) + _HALF * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])


def optical_flow(patch: Patch, start: Floats) -> Floats:
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
    return _rigid(patch, points[kept], found[kept].astype(float))


def _rigid(patch: Patch, before: Floats, after: Floats) -> Floats:
    """Fits the motion (3,) to points (n, 2) of a patch; NaN if they are too few."""
    if len(before) < 3:
        return np.full(3, np.nan)
    turn, shift = rigid_motion(before - patch.centre, after - patch.centre)
    return np.append(shift, turn)


def image_correlation(known: list[KnownPatch]) -> Floats:
    """Fits motions (patches, 3) to points that pyvale follows; NaN where it finds none.

    Each pair of pictures is correlated once, whatever patches are in it.
    """
    pairs: dict[tuple[bytes, bytes], list[int]] = {}
    for number, one in enumerate(known):
        key = one.patch.before.tobytes(), one.patch.after.tobytes()
        pairs.setdefault(key, []).append(number)
    given: dict[str, np.ndarray] = {}
    out = np.full((len(known), 3), np.nan)
    for k, numbers in enumerate(pairs.values()):
        least = min(numbers, key=lambda one: float(np.linalg.norm(known[one].motion)))
        patch = known[least].patch
        given |= {f"before_{k}": patch.before, f"after_{k}": patch.after, f"seed_{k}": patch.centre}
    with tempfile.TemporaryDirectory() as folder:
        pictures, found = Path(folder) / "pictures.npz", Path(folder) / "points.npz"
        np.savez(pictures, allow_pickle=False, **given)
        script = Path(__file__).resolve().with_name("pyvale_points.py")
        command = [PYVALE.absolute(), script, pictures, found]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=folder)
        points = dict(np.load(found))
    for k, numbers in enumerate(pairs.values()):
        for number in numbers:
            patch, seen = known[number].patch, points[f"points_{k}"]
            shape = patch.outline.astype(np.float32)
            inside = [cv2.pointPolygonTest(shape, one[:2].tolist(), False) > 0 for one in seen]
            kept = seen[np.array(inside, bool)]
            out[number] = _rigid(patch, kept[:, :2], kept[:, 2:])
    return out


def table(folder: Path = IMAGES) -> str:
    """Measures all patches; returns the lines of their table: mean and spread of the errors."""
    known = list(patches(folder))
    errors = np.full((len(known), 3, 3), np.nan)
    for error, one in zip(errors, known, strict=True):
        start = find_motion(one.patch)
        if start is not None:
            error[0] = fit_motion(one.patch, start, include_edge=one.whole) - one.motion
            error[1] = optical_flow(one.patch, start) - one.motion
    named = "pyvale"
    if PYVALE.exists():
        errors[:, 2] = image_correlation(known) - [one.motion for one in known]
    else:
        named = "pyvale (not installed)"
        LOG.warning("%s is not there: `make bench-tracking` installs pyvale", PYVALE)
    errors[..., 2] = np.angle(np.exp(1j * errors[..., 2]))
    told = "found | bias x, y px; deg | spread x, y px; deg"
    lines = [
        f"| patches | own: {told} | optical flow: {told} | {named}: {told} |",
        "|---" * 10 + "|",
    ]
    for group in dict.fromkeys(one.group for one in known):
        chosen = errors[[one.group == group for one in known]]
        lines.append(f"| {group} | {' | '.join(map(_cells, chosen.swapaxes(0, 1)))} |")
    return "\n".join(lines)


def _cells(error: Floats) -> str:
    """Describes errors (patches, 3): how many there are, their mean, their spread."""
    seen = error[np.isfinite(error[:, 0])]
    if not len(seen):
        return f"0 of {len(error)} | |"
    told = [
        f"{x:.4f}, {y:.4f}; {np.rad2deg(turn):.3f}"
        for x, y, turn in (seen.mean(axis=0), seen.std(axis=0))
    ]
    return f"{len(seen)} of {len(error)} | {' | '.join(told)}"
