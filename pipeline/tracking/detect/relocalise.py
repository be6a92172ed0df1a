"""Relocalises units after a jump that prediction cannot follow, by finding the lattice again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.detect.blobs import find_blobs, match_one_to_one
from pipeline.tracking.geometry import Camera, SpecimenOutlines, rotation_matrix
from sim.core import Floats

_TURNS = np.deg2rad([0, 8, -8, 16, -16, 24, -24, 32, -32, 40, -40])
_OWN_TURNS = np.deg2rad([0, 15, -15, 30, -30, 45, -45])
"""Tried of the specimen as a whole, and of every unit beside."""
_BIN = 0.25
_GATE = 0.4
"""How far a patch may be from the unit that it is taken for, pitches."""
_ROUNDS = 6
_ENOUGH = 0.5

_Match = tuple[Floats, float]


class Relocaliser(NamedTuple):
    """Looks for a specimen whose units are nowhere near where they were.

    Attributes:
        specimen: the units.
        camera: of its plane.
        bright: whether the units are brighter than what is behind them.
    """

    specimen: SpecimenOutlines
    camera: Camera
    bright: bool

    def candidate_poses(self, image: Picture, pose: Floats) -> Iterator[Floats]:
        """Yields poses (units, 3) that the units may have; none if too few patches match.

        Args:
            image: the frame.
            pose: (units, 3) the last that was known of all.
        """
        scale = float(self.camera.px_per_mm(self.specimen.centre.mean(axis=0)))
        seen = self.camera.unproject(find_blobs(image, self.specimen, scale, self.bright))
        before = self.specimen.centre + pose[:, :2]
        if len(seen) < _ENOUGH * len(before):
            return
        now, turn = max(self._matches(before, seen), key=_count)
        if _count((now, turn)) < _ENOUGH * len(before):
            return
        for own in _OWN_TURNS:
            yield np.column_stack([now - self.specimen.centre, pose[:, 2] + turn + own])

    def _matches(self, before: Floats, seen: Floats) -> Iterator[_Match]:
        """Tries every turn of the whole, where its middle or where most patches suggest."""
        for turn in _TURNS:
            turned = before @ rotation_matrix(-turn)
            for shift in (
                _box_centre(seen) - _box_centre(turned),
                _commonest_shift(turned, seen, _BIN * self.specimen.pitch),
            ):
                yield self._match(before, seen, turned + shift)

    def _match(self, before: Floats, seen: Floats, expected: Floats) -> _Match:
        """Returns places (units, 2) of matching patches, NaN without one, and the turn to there."""
        pitch, turn = self.specimen.pitch, 0.0
        now = np.full_like(before, np.nan)
        rows = np.column_stack([before, np.ones(len(before))])
        for _ in range(_ROUNDS):
            unit, place = match_one_to_one(expected, seen, _GATE * pitch)
            if len(unit) < _ENOUGH * len(before):
                return now, turn
            affine = np.linalg.lstsq(rows[unit], seen[place], rcond=None)[0]
            expected = rows @ affine
        now[unit] = seen[place]
        return now, float(np.arctan2(affine[0, 1] - affine[1, 0], affine[0, 0] + affine[1, 1]))


def _count(match: _Match) -> int:
    return int(np.isfinite(match[0][:, 0]).sum())


def _commonest_shift(before: Floats, seen: Floats, width: float) -> Floats:
    """Returns the shift (2,) that most pairs of places have, to within a width."""
    pairs = (seen[:, None] - before[None]).reshape(-1, 2)
    cells, count = np.unique(np.round(pairs / width), axis=0, return_counts=True)
    near = np.abs(pairs - cells[count.argmax()] * width).max(axis=1) < width
    return np.asarray(np.median(pairs[near], axis=0))


def _box_centre(points: Floats) -> Floats:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)
