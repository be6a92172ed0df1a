"""What is on the faces of the units, as a frame shows it."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.detect.blobs import LatticeDetection
from pipeline.tracking.geometry import SpecimenOutlines

_BLANK = 0.25  # of the contrast: what differs more from a face's own shade is a mark
_MARKED = 0.02  # of a face
_DOTS = 4


def classify_markings(
    image: Picture, specimen: SpecimenOutlines, sighting: LatticeDetection, px_per_mm: float
) -> str:
    """What most faces bear: dots, speckle, or nothing ("bare").

    The number of patches on them tells that differ from their own shade.
    """
    contrast = float(np.subtract(*np.percentile(image, [95, 5])))
    counts = [_marks(image, specimen, sighting, unit, contrast) for unit in sighting.unit]
    usual = float(np.median(counts))
    if usual < 1:
        return "bare"
    small = px_per_mm * specimen.pitch < 3 * _DOTS  # px: no dots can be told apart
    return "speckle" if usual > _DOTS or small else "dots"


def _marks(
    image: Picture,
    specimen: SpecimenOutlines,
    sighting: LatticeDetection,
    unit: int,
    contrast: float,
) -> int:
    """Number of patches on a face, its rim left out."""
    shrunk = specimen.centre[unit] + 0.75 * specimen.polygon(unit)
    polygon = np.round(sighting.camera.project(shrunk)).astype(np.int32)
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
