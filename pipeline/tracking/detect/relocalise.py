"""Relocalises units that prediction has lost, by finding the lattice again."""

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
_CLEAR, _FEWEST = 0.1, 3
"""A placement must be better than those at other places by this part of its matches."""
_BETTER, _HALF_SEEN, _AGREEING = 1.2, 0.5, 0.2
_ELSEWHERE = 0.5
"""Distance of places that are others, pitches."""
_SMOOTH = 25.0
"""Pixels a pitch that patches need to be seen."""


class LatticePlace(NamedTuple):
    """Holds poses (units, 3) of a lattice, and its turn since it was seen last, rad."""

    pose: Floats
    turn: float


class Relocaliser(NamedTuple):
    """Looks for a specimen whose units are nowhere near where they were."""

    specimen: SpecimenOutlines  # the units
    camera: Camera  # of its plane
    bright: bool  # whether the units are brighter than what is behind them

    def in_view(self, pose: Floats, margin: float = 0.0) -> Mask:
        """Tells which units (units,) have their middle in the picture, radii from its rim."""
        place = self.camera.project(self.specimen.centre + pose[:, :2])
        return self._inside(place, margin)

    def placed_again(self, image: Picture, pose: Floats, now: Floats) -> list[LatticePlace]:
        """Returns where patches show the lattice; places that explain as much go by rising turn.

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
        if len(patches) <= _BETTER * good.sum():
            return []

        def inside(place: Floats) -> Mask:
            return self._inside(self.camera.project(place), _MARGIN)

        before = centre + pose[:, :2]
        found = locate_lattice(before, self.specimen.joint, patches, 1.0, inside)
        if not found:
            return []
        best = found[0]
        moved = np.linalg.norm(best.place - centre - now[:, :2], axis=1)[good]
        if len(best.unit) <= _BETTER * good.sum() or best.missing > _HALF_SEEN * len(best.unit):
            return []
        if (moved < _ELSEWHERE * pitch).sum() > _AGREEING * len(best.unit):
            return []  # what is found is where it was taken to be
        alike = [best, *(other for other in found[1:] if self._rivals(best, other))]
        alike.sort(key=lambda one: abs(one.turn))
        return [
            LatticePlace(np.column_stack([one.place - centre, pose[:, 2] + one.turn]), one.turn)
            for one in alike
        ]

    def near_unclaimed(self, image: Picture, pose: Floats, good: Mask) -> Mask:
        """Tells units (units,) near whose places a patch of a unit's size is no good unit's.

        Args:
            image: the frame.
            pose: (units, 3) where units are looked for; of good ones, where they are.
            good: (units,) those found.
        """
        centre, pitch = self.specimen.centre, self.specimen.pitch
        scale = float(self.camera.px_per_mm(centre.mean(axis=0)))
        factor = max(1, int(scale * pitch / _SMOOTH))
        small = cv2.resize(image, None, fx=1 / factor, fy=1 / factor, interpolation=cv2.INTER_AREA)
        found = find_blobs(
            np.asarray(small, np.float32), self.specimen, scale / factor, self.bright
        )
        patches = self.camera.unproject((found + 0.5) * factor - 0.5)
        place, most = centre + pose[:, :2], _ELSEWHERE * pitch
        if good.any() and len(patches):
            patches = patches[cKDTree(place[good]).query(patches)[0] > most]
        if not len(patches):
            return np.zeros(len(good), bool)
        return np.asarray((cKDTree(patches).query(place)[0] < most) & ~good)

    def _rivals(self, best: Placement, other: Placement) -> bool:
        apart = np.median(np.linalg.norm(best.place - other.place, axis=1))
        clear = max(_CLEAR * len(best.unit), _FEWEST)
        return bool(apart > _ELSEWHERE * self.specimen.pitch and best.score - other.score < clear)

    def _inside(self, place: Floats, margin: float) -> Mask:
        scale = float(self.camera.px_per_mm(self.specimen.centre.mean(axis=0)))
        rim = margin * float(self.specimen.radius.mean()) * scale
        last = np.array(self.camera.size) - 1 - rim
        return np.asarray(((place > rim) & (place < last)).all(axis=-1))
