"""Fits homographies, the maps between two pictures of a plane."""

import numpy as np

from sim.core import Floats


def fit_homography(points: Floats, pixels: Floats) -> Floats:
    """Fits the homography (3, 3) of points to pixels (n, 2), n >= 4, linear least squares."""
    to_points, to_pixels = _normaliser(points), _normaliser(pixels)
    x, y = apply_homography(to_points, points).T
    u, v = apply_homography(to_pixels, pixels).T
    one, zero = np.ones_like(x), np.zeros_like(x)
    rows = np.concatenate(
        [
            np.stack([x, y, one, zero, zero, zero, -u * x, -u * y, -u], axis=1),
            np.stack([zero, zero, zero, x, y, one, -v * x, -v * y, -v], axis=1),
        ]
    )
    found = np.linalg.svd(rows, full_matrices=False)[2][-1].reshape(3, 3)
    found = np.linalg.inv(to_pixels) @ found @ to_points
    return found / found[2, 2]


def _normaliser(points: Floats) -> Floats:
    middle = points.mean(axis=0)
    scale = 1 / np.abs(points - middle).mean()
    return np.array([[scale, 0, -scale * middle[0]], [0, scale, -scale * middle[1]], [0, 0, 1.0]])


def apply_homography(matrix: Floats, points: Floats) -> Floats:
    """Maps points (n, 2) to pixels (n, 2) without distortion."""
    mapped = points @ matrix[:2, :2].T + matrix[:2, 2]
    return mapped / (points @ matrix[2, :2] + matrix[2, 2])[:, None]
