"""The units in a first frame: blobs, their ids by one-to-one matching, and the camera."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from pipeline.tracking import camera as cameras
from pipeline.tracking.arrays import Floats, Image, Ints
from pipeline.tracking.camera import Camera
from pipeline.tracking.specimen import Specimen

_ROUNDS = 12


@dataclass(frozen=True)
class Sighting:
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


def sight(image: Image, specimen: Specimen, px_per_mm: float | None) -> Sighting:
    """Finds the specimen, upright within 45 degrees, in either polarity.

    Args:
        image: the first frame.
        specimen: what to look for.
        px_per_mm: roughly; without it, the specimen is taken to fill most of the image.
    """
    scales = [px_per_mm] if px_per_mm else _likely_scales(image, specimen)
    found = [
        _matched(image, specimen, scale, bright) for scale in scales for bright in (True, False)
    ]
    return max(found, key=lambda one: (len(one.unit), -one.blobs))


def _likely_scales(image: Image, specimen: Specimen) -> list[float]:
    extent = np.ptp(specimen.centre, axis=0) + 2 * specimen.radius.mean()
    most = min(image.shape[1] / extent[0], image.shape[0] / extent[1])
    return [float(most * share) for share in (0.95, 0.8, 0.67, 0.56)]


def blobs(image: Image, specimen: Specimen, scale: float, bright: bool) -> Floats:
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


def _matched(image: Image, specimen: Specimen, scale: float, bright: bool) -> Sighting:
    centroids = blobs(image, specimen, scale, bright)
    size = (image.shape[1], image.shape[0])
    nothing = Camera(np.eye(3), np.zeros(2), np.zeros(2), size)
    if len(centroids) < 6:
        return Sighting(nothing, np.empty(0, int), np.empty((0, 2)), len(centroids), bright)
    matrix = _boxed(specimen.centre, centroids)
    unit = place = np.empty(0, int)
    for turn in range(_ROUNDS):
        seen = _seen(matrix, specimen.centre)
        unit, place = one_to_one(seen, centroids, specimen.pitch * scale * (0.5 if turn else 0.8))
        if len(unit) < 6:
            return Sighting(nothing, np.empty(0, int), np.empty((0, 2)), len(centroids), bright)
        matrix = (
            _affine(specimen.centre[unit], centroids[place])
            if turn < 4
            else cameras.homography(specimen.centre[unit], centroids[place])
        )
    camera = cameras.fit(specimen.centre[unit], centroids[place], size, 0.2)
    unit, place = one_to_one(
        camera.project(specimen.centre), centroids, 0.2 * specimen.pitch * scale
    )
    return Sighting(camera, unit, centroids[place], len(centroids), bright)


def _boxed(points: Floats, pixels: Floats) -> Floats:
    """Homography without perspective that lays the points' box, y up, over that of the pixels."""
    low, high = points.min(axis=0), points.max(axis=0)
    first, last = pixels.min(axis=0), pixels.max(axis=0)
    gain = (last - first) / (high - low)
    return np.array(
        [
            [gain[0], 0, first[0] - gain[0] * low[0]],
            [0, -gain[1], last[1] + gain[1] * low[1]],
            [0, 0, 1.0],
        ]
    )


def _affine(points: Floats, pixels: Floats) -> Floats:
    rows = np.column_stack([points, np.ones(len(points))])
    found = np.linalg.lstsq(rows, pixels, rcond=None)[0].T
    return np.vstack([found, [0, 0, 1.0]])


def _seen(matrix: Floats, points: Floats) -> Floats:
    mapped = points @ matrix[:2, :2].T + matrix[:2, 2]
    return mapped / (points @ matrix[2, :2] + matrix[2, 2])[:, None]


def one_to_one(expected: Floats, found: Floats, gate: float) -> tuple[Ints, Ints]:
    """The assignment of least total distance (capped at ``gate``), pairs beyond it left out."""
    distance = cdist(expected, found)
    rows, columns = linear_sum_assignment(np.minimum(distance, gate))
    near = distance[rows, columns] < gate
    return rows[near], columns[near]
