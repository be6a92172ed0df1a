"""Detects a specimen in a frame: blobs, their ids by one-to-one matching, camera, markings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from pipeline.runtime import Picture
from pipeline.tracking.geometry import Camera, SpecimenOutlines, rotation_matrix
from pipeline.tracking.geometry import camera as cameras
from sim.core import Floats, Image, Ints

_ROUNDS = 8
_AFFINE_ROUNDS = 4
_LEAST = 6
_UPRIGHT = 10  # deg
_NEARLY = 0.95
_GATE = 0.25
"""How far a blob may be from where a unit is expected, at last, pitches."""
_AREA = 3.0
"""A camera that makes units so many times larger or smaller than told sees something else."""
_BLOB_SIGMA = 0.2
_DOT = 0.25
"""Width of a median that a mark on a face does not survive, pitches."""
_TURNS = [np.array([[c, -s], [s, c]], float) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
_FLAT = 0.5
"""Sides of the box, of the lattice or of the blobs, may differ by so much between the two."""
_BLANK = 0.25  # of the contrast: what differs more from a face's own shade is a mark
_MARKED = 0.02  # of a face
_DOTS = 4


@dataclass(frozen=True)
class LatticeDetection:
    """Holds units of a specimen, matched with blobs of a frame.

    Attributes:
        camera: what sees the blobs where they are.
        unit: (matches,) units that have a blob of their own.
        blob: (matches, 2) its centroid, px.
        blobs: number of blobs of a unit's size.
        bright: whether the units are brighter than what is behind them.
    """

    camera: Camera
    unit: Ints
    blob: Floats
    blobs: int
    bright: bool


def specimen_orientation(camera: Camera) -> tuple[float, bool]:
    """Returns the counter-clockwise turn in the image, rad, and whether it is seen from behind."""
    upward = camera.homography[:2, 1]
    turn = float(np.arctan2(-upward[0], -upward[1]))
    return turn, bool(np.linalg.det(camera.homography[:2, :2]) > 0)


def orientation_text(camera: Camera) -> str:
    """Describes the orientation: upright, turned, seen from behind."""
    turn, behind = specimen_orientation(camera)
    degrees = round(float(np.rad2deg(turn)))
    words = f"turned by {degrees} deg" if abs(degrees) > _UPRIGHT else "upright"
    return f"{words} and mirrored, as from behind" if behind else words


def detection_summary(found: LatticeDetection, specimen: SpecimenOutlines) -> str:
    """Describes how many units were found, and where."""
    seen = f"{found.blobs} units found, {len(found.unit)} of {specimen.count} in their places"
    if not len(found.unit):
        return seen
    low, high = found.blob.min(axis=0), found.blob.max(axis=0)
    return f"{seen}, from ({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f}) px"


def detect_lattice(
    image: Picture, specimen: SpecimenOutlines, px_per_mm: float | None
) -> list[LatticeDetection]:
    """Finds the specimen, of either polarity, whichever way it is turned, mirrored or not.

    Args:
        image: the first frame.
        specimen: what to look for.
        px_per_mm: roughly; without it, the specimen is taken to fill most of the image.

    Returns:
        All ways of seeing it that match nearly as many units as the best: a lattice may look the
        same turned. Upright comes first, mirrored last. Their cameras are without distortion.
    """
    extent = np.ptp(specimen.centre, axis=0) + 2 * specimen.radius.mean()
    most = min(image.shape[1] / extent[0], image.shape[0] / extent[1])
    shares = (0.95, 0.8, 0.67, 0.56)
    scales = [px_per_mm] if px_per_mm else [float(most * share) for share in shares]
    pairs = [(scale, bright) for scale in scales for bright in (True, False)]
    found = max((_detections(image, specimen, *pair) for pair in pairs), key=_matches)
    if _matches(found) < _NEARLY * specimen.count:
        plain = {scale: _unmarked(image, specimen.pitch * scale) for scale in scales}
        tried = [_detections(plain[pair[0]], specimen, *pair) for pair in pairs]
        found = max(found, *tried, key=_matches)
    return [one for one in found if len(one.unit) >= _NEARLY * _matches(found)]


def _matches(ways: list[LatticeDetection]) -> int:
    return max(len(one.unit) for one in ways)


def _unmarked(image: Picture, pitch: float) -> Image:
    """Removes dots and speckle, which may stand out more than the faces themselves."""
    width = int(_DOT * pitch) | 1
    return np.asarray(cv2.medianBlur(np.clip(image, 0, 255).astype(np.uint8), width), np.uint8)


def _detections(
    image: Picture, specimen: SpecimenOutlines, scale: float, bright: bool
) -> list[LatticeDetection]:
    centroids = find_blobs(image, specimen, scale, bright)
    size = (image.shape[1], image.shape[0])
    camera = Camera(np.eye(3), (np.array(size) - 1) / 2, np.zeros(2), size)
    nothing = LatticeDetection(camera, np.empty(0, int), np.empty((0, 2)), len(centroids), bright)
    found = [
        _matched(specimen, centroids, matrix, scale, nothing)
        for matrix in _initial_homographies(specimen.centre, centroids)
    ]
    return found or [nothing]


def with_distortion(specimen: SpecimenOutlines, detection: LatticeDetection) -> LatticeDetection:
    """Refits the camera of a detection with distortion."""
    seen = specimen.centre[detection.unit]
    camera = cameras.fit_camera(seen, detection.blob, detection.camera.size, _BLOB_SIGMA)
    return replace(detection, camera=camera)


def find_blobs(image: Picture, specimen: SpecimenOutlines, scale: float, bright: bool) -> Floats:
    """Returns centroids (n, 2) in px of patches of a unit's size."""
    pitch = specimen.pitch * scale
    window = int(pitch * 2) | 1
    signed = image.astype(np.float32) * (1 if bright else -1)
    grey = cv2.GaussianBlur(signed, (0, 0), max(0.02 * pitch, 0.5))
    low = cv2.erode(grey, np.ones((window, window), np.uint8))
    high = cv2.dilate(grey, np.ones((window, window), np.uint8))
    middle = cv2.blur((low + high) / 2, (window, window))
    contrast = cv2.blur(high - low, (window, window))
    mask = ((grey > middle) & (contrast > 0.3 * np.percentile(contrast, 90))).astype(np.uint8)
    filled = _filled(mask, 0.3 * float(np.median(specimen.area)) * scale**2)
    size = max(int(0.12 * pitch) | 1, 3)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    opened = cv2.morphologyEx(filled, cv2.MORPH_OPEN, kernel)
    _, _, stats, centroids = cv2.connectedComponentsWithStats(opened, connectivity=4)
    areas = stats[1:, cv2.CC_STAT_AREA] / scale**2
    good = (areas > 0.4 * specimen.area.min()) & (areas < 1.8 * specimen.area.max())
    return np.asarray(centroids[1:][good], np.float64)


def _filled(mask: Image, largest: float) -> Image:
    """Fills holes of the mask smaller than ``largest`` px: dots and speckle."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(1 - mask, connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] < largest
    small[0] = False
    return np.where(small[labels], np.uint8(1), mask)


def _initial_homographies(points: Floats, pixels: Floats) -> list[Floats]:
    """Lays the points' box over that of the pixels, without perspective.

    The upright one comes first, then turned, then mirrored; lists none if there are few pixels.
    """
    if len(pixels) < _LEAST:
        return []
    angle = np.deg2rad(cv2.minAreaRect(pixels.astype(np.float32))[2])
    lean = rotation_matrix(angle - np.round(angle / (np.pi / 2)) * np.pi / 2)
    aligned = pixels @ lean
    low, high = aligned.min(axis=0), aligned.max(axis=0)
    out = []
    for side in (1.0, -1.0):
        for quarter in _TURNS:
            turn = quarter @ np.diag([side, -1.0])
            turned = points @ turn.T
            first = turned.min(axis=0)
            gain = (high - low) / (turned.max(axis=0) - first)
            if abs(np.log(gain[0] / gain[1])) < _FLAT:
                matrix = np.eye(3)
                matrix[:2, :2] = gain[:, None] * turn
                matrix[:2, 2] = low - gain * first
                matrix[:2] = lean @ matrix[:2]
                out.append(matrix)
    return out


def _matched(
    specimen: SpecimenOutlines,
    centroids: Floats,
    matrix: Floats,
    scale: float,
    nothing: LatticeDetection,
) -> LatticeDetection:
    """Alternates one-to-one matching and a better homography, from a first guess of it."""
    pitch = specimen.pitch * scale
    for turn in range(_ROUNDS):
        gate = pitch * (0.5 if turn else 0.8)
        expected = cameras.apply_homography(matrix, specimen.centre)
        unit, place = match_one_to_one(expected, centroids, gate)
        if len(unit) < _LEAST:
            return nothing
        fit = _fit_affine if turn < _AFFINE_ROUNDS else cameras.fit_homography
        matrix = fit(specimen.centre[unit], centroids[place])
    expected = cameras.apply_homography(matrix, specimen.centre)
    unit, place = match_one_to_one(expected, centroids, _GATE * pitch)
    camera = replace(nothing.camera, homography=matrix / matrix[2, 2])
    areas = np.abs(np.linalg.det(camera.jacobian(specimen.centre))) / scale**2
    if not (areas.min() > 1 / _AREA and areas.max() < _AREA):
        return nothing
    return replace(nothing, camera=camera, unit=unit, blob=centroids[place])


def _fit_affine(points: Floats, pixels: Floats) -> Floats:
    rows = np.column_stack([points, np.ones(len(points))])
    found = np.linalg.lstsq(rows, pixels, rcond=None)[0].T
    return np.vstack([found, [0, 0, 1.0]])


def match_one_to_one(expected: Floats, found: Floats, gate: float) -> tuple[Ints, Ints]:
    """Assigns with least total distance (capped at ``gate``), pairs beyond it left out."""
    distance = cdist(expected, found)
    rows, columns = linear_sum_assignment(np.minimum(distance, gate))
    near = distance[rows, columns] < gate
    return rows[near], columns[near]


def classify_markings(
    image: Picture, specimen: SpecimenOutlines, detection: LatticeDetection, px_per_mm: float
) -> str:
    """Classifies what most faces bear: dots, speckle, or nothing ("bare").

    The number of patches on them tells that differ from their own shade.
    """
    contrast = float(np.subtract(*np.percentile(image, [95, 5])))
    counts = [_marks(image, specimen, detection, unit, contrast) for unit in detection.unit]
    usual = float(np.median(counts))
    if usual < 1:
        return "bare"
    small = px_per_mm * specimen.pitch < 3 * _DOTS  # px: no dots can be told apart
    return "speckle" if usual > _DOTS or small else "dots"


def _marks(
    image: Picture,
    specimen: SpecimenOutlines,
    detection: LatticeDetection,
    unit: int,
    contrast: float,
) -> int:
    """Counts patches on a face, its rim left out."""
    shrunk = specimen.centre[unit] + 0.75 * specimen.polygon(unit)
    polygon = np.round(detection.camera.project(shrunk)).astype(np.int32)
    left, top, wide, high = cv2.boundingRect(polygon)
    area = image[max(top, 0) : top + high, max(left, 0) : left + wide].astype(float)
    if area.size == 0:
        return 0
    mask = np.zeros(area.shape, np.uint8)
    cv2.fillPoly(mask, [polygon - [max(left, 0), max(top, 0)]], 1)
    face = np.median(area[mask > 0]) if mask.any() else 0.0
    differs = ((np.abs(area - face) > _BLANK * contrast) & (mask > 0)).astype(np.uint8)
    if differs.sum() < _MARKED * mask.sum():
        return 0
    return int(cv2.connectedComponents(differs, connectivity=8)[0]) - 1
