"""Measures patches of photographs and of DIC Challenge images whose motions are known.

Every patch is found unaided (SIFT and RANSAC: Lowe, IJCV 60 (2004) 91), then fitted by the
tracker's correlation and, from the same start, by OpenCV's pyramidal optical flow.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from pipeline.tracking.fit import PoseFitter, TemplateGrid, learn_templates
from pipeline.tracking.geometry import Camera, SpecimenOutlines, rigid_motion, rotation_matrix
from sim.core import Floats, Image

IMAGES = Path("tests/data/tracking/dic")
_HALF, _MARGIN, _STEP = 20, 24, 4
"""Half a side of a square patch, its distance from others' features, step of flow's points, px."""
_LEFT = 700
"""Column at which the stored parts of the challenge's images begin."""


class Patch(NamedTuple):
    """Holds a patch, and how it moved: pixels, x right, y down, rad from x to y.

    Attributes:
        group: of patches, which a line of the table tells of.
        before, after: the images.
        outline: (n, 2) in the first one.
        centre: (2,) whose motion is told.
        motion: (3,).
    """

    group: str
    before: Image
    after: Image
    outline: Floats
    centre: Floats
    motion: Floats


def patches(folder: Path = IMAGES) -> Iterator[Patch]:
    """Yields the patches of all images."""
    with (folder / "truth.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["set"] == "part"]
    for row in rows:
        numbers = np.array(row["patch"].removeprefix("polygon ").split(), float).reshape(-1, 2)
        motion = np.array([row["u_px"], row["v_px"], row["rotation_rad"]], float)
        after = _read(folder, Path(row["image"]).stem)
        before, centre = _read(folder, "pc_ref"), np.array([250.0, 250.0])
        yield Patch("part, steps of 30 deg", before, after, numbers, centre, motion)
    before, after = _read(folder, "rotation_000"), _read(folder, "rotation_170")
    turn = np.deg2rad(-170.0)
    for x, y in ((256, 256), (200, 180), (320, 200), (190, 330), (330, 310)):
        there = np.array([x, y], float)
        shift = rotation_matrix(turn) @ (there - 256) + 256 - there
        yield Patch(
            "pair turned by 170 deg", before, after, _square(x, y), there, np.append(shift, turn)
        )
    before, after = _read(folder, "challenge15_Reference"), _read(folder, "challenge15_P200_K50_N2")
    for rows_, v in (((60, 110), -9.57125), ((850, 910), 0.0)):
        for y in rows_:
            for x in range(60, 560, 60):
                motion = np.array([0.0, v, 0.0])
                there = np.array([x, y], float)
                yield Patch("DIC Challenge 15", before, after, _square(x, y), there, motion)
    yield from _mechanism(folder)


def _mechanism(folder: Path) -> Iterator[Patch]:
    """Yields three parts of an escapement, with DICe's own tracking for truth."""
    with (folder / "mechanism_parts.csv").open(encoding="utf-8") as file:
        parts = {row["part"]: row for row in csv.DictReader(file)}
    with (folder / "mechanism_reference.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["frame"] != "4870"]
    before = _read(folder, "mechanism_4870")
    for row in rows:
        part = parts[row["part"]]
        numbers = np.array(part["polygon_x_y_px"].split(), float).reshape(-1, 2)
        centre = np.array([part["centre_x_px"], part["centre_y_px"]], float)
        motion = np.array([row["dice_u_px"], row["dice_v_px"], row["dice_rotation_rad"]], float)
        after = _read(folder, f"mechanism_{row['frame']}")
        yield Patch(
            f"escapement, part {row['part']}, against DICe", before, after, numbers, centre, motion
        )


def _read(folder: Path, name: str) -> Image:
    return np.asarray(cv2.imread(str(folder / f"{name}.png"), cv2.IMREAD_GRAYSCALE), np.uint8)


def _square(x: float, y: float) -> Floats:
    return np.array([x, y]) + _HALF * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])


def found_unaided(patch: Patch) -> Floats | None:
    """Finds the motion (3,) of a patch roughly, by features; nothing if too few agree."""
    sift, mask = cv2.SIFT.create(), np.zeros_like(patch.before)
    cv2.fillPoly(mask, [np.round(patch.outline).astype(np.int32)], 255)
    about = cv2.dilate(mask, np.ones((_MARGIN, _MARGIN), np.uint8))
    first, described = sift.detectAndCompute(patch.before, about)
    second, others = sift.detectAndCompute(patch.after, None)
    if len(first) < 4 or len(second) < 4:
        return None
    pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(described, others, k=2)
    good = [near for near, next_ in pairs if near.distance < 0.8 * next_.distance]
    if len(good) < 4:
        return None
    start = np.array([first[one.queryIdx].pt for one in good])
    end = np.array([second[one.trainIdx].pt for one in good])
    matrix, kept = cv2.estimateAffinePartial2D(start, end, ransacReprojThreshold=2.0)
    if np.ndim(matrix) < 2 or kept.sum() < 4:
        return None
    turn = float(np.arctan2(matrix[1, 0], matrix[0, 0]))
    return np.append(matrix[:, :2] @ patch.centre + matrix[:, 2] - patch.centre, turn)


def correlated(patch: Patch, start: Floats) -> Floats:
    """Fits the motion (3,) by the tracker's correlation."""
    rows, columns = patch.before.shape
    camera = Camera(np.eye(3), np.array([columns, rows]) / 2 - 0.5, np.zeros(2), (columns, rows))
    outline = (patch.outline - patch.centre)[None]
    if cv2.contourArea(outline[0].astype(np.float32), oriented=True) < 0:
        outline = outline[:, ::-1]
    none = np.zeros(outline.shape[:2], bool)
    shown = SpecimenOutlines(
        np.array([0]), patch.centre[None], outline, np.empty((0, 2), int), none
    )
    templates = learn_templates(
        patch.before, camera, TemplateGrid(shown, 1.0, 4.0), 0.3, 1.0, "speckle"
    )
    fitter = PoseFitter(camera, templates)
    _, photometry = fitter.start(1.0)
    return np.asarray(fitter.fit(patch.after, start[None], photometry).pose[0])


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
    for patch in patches(folder):
        start = found_unaided(patch)
        both = [
            np.full(3, np.nan) if start is None else one(patch, start) - patch.motion
            for one in (correlated, flowed)
        ]
        for error in both:
            error[2] = np.angle(np.exp(1j * error[2]))
        errors.setdefault(patch.group, []).append((both[0], both[1]))
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
