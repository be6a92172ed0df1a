"""Tracks by plain OpenCV, to measure against: thresholds, centroids and matched corners.

Patches above a local threshold are the units in the first frame, matched one to one with the
design: the same as for the tracker itself, so that both have all units. What is seen at each corner
there is looked for in every frame by normalised cross-correlation, turned as the unit was last,
with a parabola through the peak; these places give a rigid motion, and one number turns pixels into
millimetres.
"""

from collections.abc import Iterator

import cv2
import numpy as np

from pipeline.tracking.detect import detect_lattice
from pipeline.tracking.geometry import SpecimenOutlines, rigid_motion
from sim.core import Floats, Image

_HALF_WINDOW = 0.16
"""Half the side of what is matched, and how far it is looked for, pitches."""
_REACH = 0.12
_CORNER_INSET = 0.85
"""Corners are looked for so far from the middle, of their distance from it."""
_LEAST_CORRELATION = 0.6
"""Least correlation of a corner that is found."""


def track(images: Iterator[Image], specimen: SpecimenOutlines, px_per_mm: float) -> Floats:
    """Returns displacements (frames, units, 3), mm, rad; NaN where no two corners are found."""
    first = next(images)
    found = detect_lattice(first, specimen, px_per_mm)[0]
    flip = np.array([px_per_mm, -px_per_mm])
    followers = [
        _CornerTracker(
            first, place, _CORNER_INSET * specimen.polygon(one) * flip, specimen.pitch * px_per_mm
        )
        for one, place in zip(found.unit, found.blob, strict=True)
    ]
    out = [np.full((specimen.count, 3), np.nan)]
    out[0][found.unit] = 0.0
    for image in images:
        out.append(np.full((specimen.count, 3), np.nan))
        out[-1][found.unit] = [one.step(image) for one in followers]
    return np.array(out) * [1 / px_per_mm, -1 / px_per_mm, -1]


class _CornerTracker:
    """Follows the corners of one unit, from frame to frame."""

    def __init__(self, image: Image, centre: Floats, corners: Floats, pitch: float) -> None:
        self._half, self._reach = int(_HALF_WINDOW * pitch), int(_REACH * pitch)
        self._image, self._centre = image, centre
        self._corners = np.round(centre + corners)
        self._turn, self._shift = 0.0, np.zeros(2)

    def step(self, image: Image) -> tuple[float, float, float]:
        """Returns shift in px and turn in rad since the first frame, y down; NaN if it is lost."""
        cos, sin = np.cos(self._turn), np.sin(self._turn)
        turn = np.array([[cos, -sin], [sin, cos]])
        expected = (self._corners - self._centre) @ turn.T + self._centre + self._shift
        found = [
            self._matched(image, corner, place, turn)
            for corner, place in zip(self._corners, expected, strict=True)
        ]
        good = np.array([place is not None for place in found])
        if good.sum() < 2:
            return np.nan, np.nan, np.nan
        there = np.array([place for place in found if place is not None])
        more, shift = rigid_motion(self._corners[good] - self._centre, there - self._centre)
        self._turn, self._shift = more, shift
        return float(shift[0]), float(shift[1]), more

    def _matched(self, image: Image, corner: Floats, place: Floats, turn: Floats) -> Floats | None:
        """Finds the surroundings of a corner in a frame, about a place; None if nowhere."""
        patch = _turned(self._image, corner, turn, self._half)
        middle = np.round(place)
        window = _turned(image, middle, np.eye(2), self._half + self._reach)
        scores = np.asarray(cv2.matchTemplate(window, patch, cv2.TM_CCOEFF_NORMED), np.float64)
        _, best, _, (column, row) = cv2.minMaxLoc(scores)
        if not best > _LEAST_CORRELATION:
            return None
        peak = np.array([column + _peak(scores[row], column), row + _peak(scores[:, column], row)])
        return np.asarray(middle - self._reach + peak)


def _turned(image: Image, middle: Floats, turn: Floats, half: int) -> Image:
    """Cuts a turned square of the image about a pixel."""
    there = np.column_stack([turn.T, middle - turn.T @ np.full(2, half)])
    size = (2 * half + 1, 2 * half + 1)
    kind = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    out = cv2.warpAffine(image, there, size, flags=kind, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(out, np.uint8)


def _peak(line: Floats, place: int) -> float:
    """Returns the peak of the parabola through the largest value and its neighbours, from there."""
    if not 0 < place < len(line) - 1:
        return 0.0
    before, here, after = line[place - 1 : place + 2]
    bend = before - 2 * here + after
    return float(0.5 * (before - after) / bend) if bend < 0 else 0.0
