"""The units in a first frame: blobs, their ids by one-to-one matching, and the camera."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from pipeline.runtime import Picture
from pipeline.tracking.detect import orientation
from pipeline.tracking.geometry import Camera, SpecimenOutlines
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


@dataclass(frozen=True)
class LatticeDetection:
    """The specimen as it was found.

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
    """How far the specimen is turned in the image, counter-clockwise, and if seen from behind."""
    upward = camera.homography[:2, 1]
    turn = float(np.arctan2(-upward[0], -upward[1]))
    return turn, bool(np.linalg.det(camera.homography[:2, :2]) > 0)


def orientation_text(camera: Camera) -> str:
    """The same in words: upright, turned, seen from behind."""
    turn, behind = specimen_orientation(camera)
    degrees = round(float(np.rad2deg(turn)))
    words = f"turned by {degrees} deg" if abs(degrees) > _UPRIGHT else "upright"
    return f"{words} and mirrored, as from behind" if behind else words


def detection_summary(found: LatticeDetection, specimen: SpecimenOutlines) -> str:
    """How many units were found, and where."""
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
    scales = [px_per_mm] if px_per_mm else _likely_scales(image, specimen)
    found = _best(image, specimen, scales)
    if _most(found) < _NEARLY * specimen.count:
        plain = [(scale, _unmarked(image, specimen.pitch * scale)) for scale in scales]
        found = max(found, *(_best(shown, specimen, [scale]) for scale, shown in plain), key=_most)
    return [one for one in found if len(one.unit) >= _NEARLY * _most(found)]


def _best(
    image: Picture, specimen: SpecimenOutlines, scales: list[float]
) -> list[LatticeDetection]:
    """The ways to see it at the scale, and of the polarity, that match the most units."""
    ways = [_ways(image, specimen, scale, bright) for scale in scales for bright in (True, False)]
    return max(ways, key=_most)


def _unmarked(image: Picture, pitch: float) -> Image:
    """The image without dots and speckle, which may stand out more than the faces themselves."""
    width = int(_DOT * pitch) | 1
    return np.asarray(cv2.medianBlur(np.clip(image, 0, 255).astype(np.uint8), width), np.uint8)


def _ways(
    image: Picture, specimen: SpecimenOutlines, scale: float, bright: bool
) -> list[LatticeDetection]:
    centroids = find_blobs(image, specimen, scale, bright)
    size = (image.shape[1], image.shape[0])
    camera = Camera(np.eye(3), (np.array(size) - 1) / 2, np.zeros(2), size)
    nothing = LatticeDetection(camera, np.empty(0, int), np.empty((0, 2)), len(centroids), bright)
    found = [
        _matched(specimen, centroids, matrix, scale, nothing)
        for matrix in orientation.initial_homographies(specimen.centre, centroids)
    ]
    return found or [nothing]


def _most(ways: list[LatticeDetection]) -> int:
    return max(len(one.unit) for one in ways)


def with_distortion(specimen: SpecimenOutlines, sighting: LatticeDetection) -> LatticeDetection:
    """The same with distortion in its camera."""
    first = sighting.camera
    seen = specimen.centre[sighting.unit]
    camera = cameras.fit_camera(seen, sighting.blob, first.size, _BLOB_SIGMA)
    return replace(sighting, camera=camera)


def _likely_scales(image: Picture, specimen: SpecimenOutlines) -> list[float]:
    extent = np.ptp(specimen.centre, axis=0) + 2 * specimen.radius.mean()
    most = min(image.shape[1] / extent[0], image.shape[0] / extent[1])
    return [float(most * share) for share in (0.95, 0.8, 0.67, 0.56)]


def find_blobs(image: Picture, specimen: SpecimenOutlines, scale: float, bright: bool) -> Floats:
    """Centroids (n, 2) in px of patches of a unit's size."""
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
    smallest, largest = 0.4 * specimen.area.min(), 1.8 * specimen.area.max()
    good = (areas > smallest) & (areas < largest)
    return np.asarray(centroids[1:][good], np.float64)


def _filled(mask: Image, largest: float) -> Image:
    """The mask with its holes smaller than ``largest`` px filled: dots and speckle."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(1 - mask, connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] < largest
    small[0] = False
    return np.where(small[labels], np.uint8(1), mask)


def _matched(
    specimen: SpecimenOutlines,
    centroids: Floats,
    matrix: Floats,
    scale: float,
    nothing: LatticeDetection,
) -> LatticeDetection:
    """One to one, from a first guess of the homography, by turns with a better one."""
    for turn in range(_ROUNDS):
        gate = specimen.pitch * scale * (0.5 if turn else 0.8)
        unit, place = match_one_to_one(_seen(matrix, specimen.centre), centroids, gate)
        if len(unit) < _LEAST:
            return nothing
        found = _affine if turn < _AFFINE_ROUNDS else cameras.fit_homography
        matrix = found(specimen.centre[unit], centroids[place])
    unit, place = match_one_to_one(
        _seen(matrix, specimen.centre), centroids, _GATE * specimen.pitch * scale
    )
    camera = replace(nothing.camera, homography=matrix / matrix[2, 2])
    areas = np.abs(np.linalg.det(camera.jacobian(specimen.centre))) / scale**2
    if not (areas.min() > 1 / _AREA and areas.max() < _AREA):
        return nothing
    return replace(nothing, camera=camera, unit=unit, blob=centroids[place])


def _affine(points: Floats, pixels: Floats) -> Floats:
    rows = np.column_stack([points, np.ones(len(points))])
    found = np.linalg.lstsq(rows, pixels, rcond=None)[0].T
    return np.vstack([found, [0, 0, 1.0]])


def _seen(matrix: Floats, points: Floats) -> Floats:
    mapped = points @ matrix[:2, :2].T + matrix[:2, 2]
    return mapped / (points @ matrix[2, :2] + matrix[2, 2])[:, None]


def match_one_to_one(expected: Floats, found: Floats, gate: float) -> tuple[Ints, Ints]:
    """The assignment of least total distance (capped at ``gate``), pairs beyond it left out."""
    distance = cdist(expected, found)
    rows, columns = linear_sum_assignment(np.minimum(distance, gate))
    near = distance[rows, columns] < gate
    return rows[near], columns[near]
