"""Which way up a specimen may be: ways to lay its lattice over blobs."""

from __future__ import annotations

import cv2
import numpy as np

from sim.core import Floats

_TURNS = [np.array([[c, -s], [s, c]], float) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
_FLAT = 0.5
"""Sides of the box, of the lattice or of the blobs, may differ by so much between the two."""


def initial_homographies(points: Floats, pixels: Floats) -> list[Floats]:
    """Homographies without perspective that lay the points' box over that of the pixels.

    The upright one comes first, then turned, then mirrored; lists none if there are few pixels.
    """
    if len(pixels) < 6:
        return []
    box = cv2.minAreaRect(pixels.astype(np.float32))
    angle = np.deg2rad(box[2])
    angle -= np.round(angle / (np.pi / 2)) * np.pi / 2
    cos, sin = np.cos(angle), np.sin(angle)
    lean = np.array([[cos, -sin], [sin, cos]])
    aligned = pixels @ lean
    low, high = aligned.min(axis=0), aligned.max(axis=0)
    laid = [
        _laid(points, turn @ np.diag([side, -1.0]), low, high)
        for side in (1.0, -1.0)
        for turn in _TURNS
    ]
    out = []
    for matrix, gain in laid:
        if abs(np.log(gain[0] / gain[1])) < _FLAT:
            matrix[:2] = lean @ matrix[:2]
            out.append(matrix)
    return out


def _laid(points: Floats, turn: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """A turn, then what lays its outcome's box between two corners; with the scales it takes."""
    turned = points @ turn.T
    first, last = turned.min(axis=0), turned.max(axis=0)
    gain = (high - low) / (last - first)
    matrix = np.eye(3)
    matrix[:2, :2] = gain[:, None] * turn
    matrix[:2, 2] = low - gain * first
    return matrix, gain
