"""Relocalises lost units by detecting the lattice again."""

from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree

from pipeline.runtime import Picture
from pipeline.tracking.detect.blobs import find_blobs
from pipeline.tracking.detect.lattice_votes import Placement, locate_lattice
from pipeline.tracking.geometry import Camera, SpecimenOutlines
from sim.core import Floats, Mask

_MARGIN = 1.0
"""A unit nearer to the rim of the picture is not expected to be a patch of its own, radii."""
_LEAST_MARGIN, _FEWEST = 0.1, 3
"""A placement must be better than those at other places by this part of its matches."""
_MATCH_RATIO, _MISSING_SHARE, _SAME_SHARE = 1.03, 0.5, 0.2
_PLACE_DIFFERENCE = 0.5
"""Distance of places that are others, pitches."""
_DETECTION_PIXELS = 25.0
"""Pixels a pitch that patches need to be seen."""


class LatticePlace(NamedTuple):
    """Holds poses (units, 3) of a lattice, and its turn since it was seen last, rad."""

    pose: Floats
    turn: float


class Relocaliser(NamedTuple):
    """Detects a specimen whose units are far from their last places."""

    specimen: SpecimenOutlines  # the units
    camera: Camera  # of its plane
    bright: bool  # whether the units are brighter than what is behind them

    def in_view(self, pose: Floats, margin: float = 0.0) -> Mask:
        """Marks units (units,) whose middle is in the picture, `margin` radii from its rim."""
        place = self.camera.project(self.specimen.centre + pose[:, :2])
        return self._inside(place, margin)

    def find_lattice(self, image: Picture, pose: Floats, now: Floats) -> list[LatticePlace]:
        """Finds where patches show the lattice; equivalent places are sorted by rising turn.

        Nothing is returned where fewer patches match than good units claim.

        Args:
            image: the frame.
            pose: (units, 3) the last that was known of nearly all.
            now: (units, 3) those of this frame, NaN where not found.
        """
        centre, pitch = self.specimen.centre, self.specimen.pitch
        scale = float(self.camera.px_per_mm(centre.mean(axis=0)))
        patches = self.camera.unproject(find_blobs(image, self.specimen, scale, self.bright))
        good = np.isfinite(now[:, 0])
        if len(patches) <= _MATCH_RATIO * good.sum():
            return []

        def inside(place: Floats) -> Mask:
            return self._inside(self.camera.project(place), _MARGIN)

        before = centre + pose[:, :2]
        found = locate_lattice(before, self.specimen.joint, patches, 1.0, inside)
        if not found:
            return []
        best = found[0]
        matches = len(best.unit)
        if matches <= _MATCH_RATIO * good.sum() or best.missing > _MISSING_SHARE * matches:
            return []
        candidates = [best, *(other for other in found[1:] if self._is_ambiguous(best, other))]
        for one in candidates:
            moved = np.linalg.norm(one.place - centre - now[:, :2], axis=1)[good]
            if (moved < _PLACE_DIFFERENCE * pitch).sum() > _SAME_SHARE * matches:
                return []  # what is found may be where it was taken to be
        candidates.sort(key=lambda one: abs(one.turn))
        return [
            LatticePlace(np.column_stack([one.place - centre, pose[:, 2] + one.turn]), one.turn)
            for one in candidates
        ]

    def near_unassigned(self, image: Picture, pose: Floats, good: Mask) -> Mask:
        """Marks units (units,) near whose places there is a patch that no good unit is assigned to.

        Args:
            image: the frame.
            pose: (units, 3) where units are looked for; of good ones, where they are.
            good: (units,) those found.
        """
        centre, pitch = self.specimen.centre, self.specimen.pitch
        scale = float(self.camera.px_per_mm(centre.mean(axis=0)))
        factor = max(1, int(scale * pitch / _DETECTION_PIXELS))
        small = cv2.resize(image, None, fx=1 / factor, fy=1 / factor, interpolation=cv2.INTER_AREA)
        found = find_blobs(
            np.asarray(small, np.float32), self.specimen, scale / factor, self.bright
        )
        patches = self.camera.unproject((found + 0.5) * factor - 0.5)
        place, most = centre + pose[:, :2], _PLACE_DIFFERENCE * pitch
        if good.any() and len(patches):
            patches = patches[cKDTree(place[good]).query(patches)[0] > most]
        if not len(patches):
            return np.zeros(len(good), bool)
        return np.asarray((cKDTree(patches).query(place)[0] < most) & ~good)

    def _is_ambiguous(self, best: Placement, other: Placement) -> bool:
        apart = np.median(np.linalg.norm(best.place - other.place, axis=1))
        clear = max(_LEAST_MARGIN * len(best.unit), _FEWEST)
        return bool(
            apart > _PLACE_DIFFERENCE * self.specimen.pitch and best.score - other.score < clear
        )

    def _inside(self, place: Floats, margin: float) -> Mask:
        scale = float(self.camera.px_per_mm(self.specimen.centre.mean(axis=0)))
        rim = margin * float(self.specimen.radius.mean()) * scale
        last = np.array(self.camera.size) - 1 - rim
        return np.asarray(((place > rim) & (place < last)).all(axis=-1))
