"""Maps the specimen's plane to pixels and back: homography and radial distortion about a centre.

For a flat specimen this is the pinhole camera with radial distortion, whatever its pose and focal
length (Zhang, IEEE TPAMI 22 (2000) 1330). Pixels count from the centre of the top left one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from sim.core import Floats

_INVERSE_STEPS = 8
_CENTRE_PRIOR = 0.03
"""Standard deviation of the distortion's centre about the middle of the image, in image sizes."""
_DISTORTION_PRIOR = 0.3


@dataclass(frozen=True)
class Camera:
    """Models a camera that looks at a plane.

    Attributes:
        homography: (3, 3) from mm in the plane to pixels without distortion, last entry one.
        centre: (2,) centre of the distortion, px.
        radial: (2,) coefficients of the second and fourth power of the radius.
        size: width and height of the image, px; their larger half is the unit of the radius.
    """

    homography: Floats
    centre: Floats
    radial: Floats
    size: tuple[int, int]

    @property
    def scale(self) -> float:
        """Returns the unit of the radius, px."""
        return max(self.size) / 2

    def project(self, points: Floats) -> Floats:
        """Maps points (..., 2) of the plane in mm to pixels (..., 2)."""
        h = self.homography
        flat = points @ h[:2, :2].T + h[:2, 2]
        flat /= (points @ h[2, :2] + h[2, 2])[..., None]
        offset = flat - self.centre
        square = np.sum((offset / self.scale) ** 2, axis=-1, keepdims=True)
        return self.centre + offset * (1 + square * (self.radial[0] + square * self.radial[1]))

    def unproject(self, pixels: Floats) -> Floats:
        """Maps pixels (..., 2) to points (..., 2) of the plane in mm."""
        offset = (pixels - self.centre) * self._undistorting(pixels)[..., None]
        inverse = np.linalg.inv(self.homography)
        flat = offset + self.centre
        points = flat @ inverse[:2, :2].T + inverse[:2, 2]
        return points / (flat @ inverse[2, :2] + inverse[2, 2])[..., None]

    def _undistorting(self, pixels: Floats) -> Floats:
        """Solves for the radius (...) without distortion over that with it, by Newton's method."""
        first, second = self.radial
        seen = np.maximum(np.linalg.norm((pixels - self.centre) / self.scale, axis=-1), 1e-12)
        radius = seen
        for _ in range(_INVERSE_STEPS):
            square = radius**2
            excess = radius * (1 + square * (first + square * second)) - seen
            radius = radius - excess / (1 + square * (3 * first + square * 5 * second))
        return radius / seen

    def jacobian(self, points: Floats) -> Floats:
        """Differentiates (..., 2, 2) the pixels after the points, px/mm."""
        step = 1e-3
        ends = [
            (self.project(points + shift) - self.project(points - shift)) / (2 * step)
            for shift in (np.array([step, 0.0]), np.array([0.0, step]))
        ]
        return np.stack(ends, axis=-1)

    def px_per_mm(self, points: Floats) -> Floats:
        """Returns the scale (...) at points (..., 2), px/mm."""
        return np.asarray(np.sqrt(np.abs(np.linalg.det(self.jacobian(points)))))


def fit_camera(
    points: Floats, pixels: Floats, size: tuple[int, int], sigma: float, start: Camera | None = None
) -> Camera:
    """Fits the camera that sees the points at the pixels, by robust least squares.

    Args:
        points: (n, 2) mm, at least four, not on a line.
        pixels: (n, 2) where they are seen.
        size: of the image, px.
        sigma: standard uncertainty of the pixels; weighs the weak prior of centre and distortion
            (both near the middle, none) and tells outliers.
        start: a camera near the solution; by default the best homography.
    """
    if start is None:
        start = Camera(fit_homography(points, pixels), (np.array(size) - 1) / 2, np.zeros(2), size)
    span = np.abs(points - points.mean(axis=0)).max()
    scaling = np.array([1, 1, span, 1, 1, span, 1 / span, 1 / span]) / span
    unit = np.concatenate([scaling * start.scale, np.full(2, start.scale), np.ones(2)])
    unit[6:8] = 1 / span
    middle = (np.array(size) - 1) / 2

    def camera(vector: Floats) -> Camera:
        values = vector * unit
        return Camera(np.append(values[:8], 1.0).reshape(3, 3), values[8:10], values[10:12], size)

    def residuals(vector: Floats) -> Floats:
        made = camera(vector)
        prior = np.concatenate(
            [(made.centre - middle) / (_CENTRE_PRIOR * max(size)), made.radial / _DISTORTION_PRIOR]
        )
        return np.concatenate([((made.project(points) - pixels) / sigma).ravel(), prior])

    first = np.concatenate([start.homography.ravel()[:8], start.centre, start.radial]) / unit
    near = least_squares(residuals, first, x_scale="jac", xtol=1e-12)
    found = least_squares(residuals, near.x, loss="soft_l1", f_scale=3.0, x_scale="jac", xtol=1e-12)
    return camera(found.x)


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
