"""Maps the specimen's plane to pixels and back: homography and radial distortion about a centre.

For a flat specimen this is the pinhole camera with radial distortion, whatever its pose and focal
length (Zhang, IEEE TPAMI 22 (2000) 1330). A fisheye maps the angle to its axis, not the tangent, to
the radius (Kannala and Brandt, IEEE TPAMI 28 (2006) 1335, as OpenCV has it). Pixels count from the
centre of the top left one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from sim.core import Floats

_INVERSE_STEPS = 8
_CENTRE_PRIOR = 0.03
"""Standard deviation of the distortion's centre about the middle of the image, in image sizes."""
_DISTORTION_PRIOR = 0.3
_TINY = 1e-9
_STEEPEST = 1.55
"""Angle to the axis of a fisheye beyond which nothing of a plane is seen, rad."""
_FISHEYE = (0.7, 0.5)
"""A usual one, from which to start, and the standard deviation of the prior."""
_BETTER = 0.6
"""A fisheye's squared residuals must be so much smaller than those of the usual lens."""


@dataclass(frozen=True)
class Camera:
    """Models a camera that looks at a plane.

    Attributes:
        homography: (3, 3) from mm in the plane to pixels without distortion, last entry one.
        centre: (2,) centre of the distortion, px.
        radial: (2,) coefficients of the second and fourth power of the radius.
        size: width and height of the image, px; their larger half is the unit of the radius.
        fisheye: the unit of the radius over the focal length of a fisheye, zero for other lenses;
            the radial coefficients are then those of the angle.
    """

    homography: Floats
    centre: Floats
    radial: Floats
    size: tuple[int, int]
    fisheye: float = 0.0

    @property
    def coefficients(self) -> Floats:
        """Returns the radial ones, and that of a fisheye if it is one."""
        return np.append(self.radial, self.fisheye) if self.fisheye else self.radial

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
        ratio = 1.0
        if self.fisheye:
            slope = np.maximum(self.fisheye * np.sqrt(square), _TINY)
            ratio = np.arctan(slope) / slope
            square = square * ratio**2
        radial = 1 + square * (self.radial[0] + square * self.radial[1])
        return np.asarray(self.centre + offset * (ratio * radial))

    def unproject(self, pixels: Floats) -> Floats:
        """Maps pixels (..., 2) to points (..., 2) of the plane in mm."""
        offset = (pixels - self.centre) * self._undistorting(pixels)[..., None]
        inverse = np.linalg.inv(self.homography)
        flat = offset + self.centre
        points = flat @ inverse[:2, :2].T + inverse[:2, 2]
        return points / (flat @ inverse[2, :2] + inverse[2, 2])[..., None]

    def facing(self, points: Floats, pixels: Floats) -> Camera:
        """Returns one of the same lens that sees points (n, 2) at pixels: another homography."""
        ratio = self._undistorting(pixels)[..., None]
        flat = self.centre + (pixels - self.centre) * ratio
        return replace(self, homography=fit_homography(points, flat))

    def _undistorting(self, pixels: Floats) -> Floats:
        """Solves for the radius (...) without distortion over that with it, by Newton's method."""
        first, second = self.radial
        seen = np.maximum(np.linalg.norm((pixels - self.centre) / self.scale, axis=-1), 1e-12)
        radius = seen
        for _ in range(_INVERSE_STEPS):
            square = radius**2
            excess = radius * (1 + square * (first + square * second)) - seen
            radius = radius - excess / (1 + square * (3 * first + square * 5 * second))
        if self.fisheye:
            angle = np.minimum(self.fisheye * radius, _STEEPEST)
            radius = radius * np.tan(angle) / np.maximum(angle, _TINY)
        return np.asarray(radius / seen)

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


def camera_of(dataset: xr.Dataset) -> Camera | None:
    """Reads the camera that a track was made with; points of another system come without."""
    homography = dataset["camera_homography"].values
    if np.isnan(homography).any():
        return None
    width, height = dataset["image_size"].values.tolist()
    first, second, *fisheye = dataset["camera_radial"].values.tolist()
    centre = dataset["camera_centre"].values
    return Camera(homography, centre, np.array([first, second]), (width, height), *fisheye)


def fit_camera(
    points: Floats, pixels: Floats, size: tuple[int, int], sigma: float, start: Camera | None = None
) -> Camera:
    """Fits the camera that sees the points at the pixels, by robust least squares.

    The usual lens is taken, unless a fisheye leaves much less of a residual; a start has one kind.

    Args:
        points: (n, 2) mm, at least four, not on a line.
        pixels: (n, 2) where they are seen.
        size: of the image, px.
        sigma: standard uncertainty of the pixels; weighs the weak prior of centre and distortion
            (both near the middle, none) and tells outliers.
        start: a camera near the solution; by default the best homography.
    """
    if start is not None:
        return _fit_lens(points, pixels, sigma, start)
    homography, middle = fit_homography(points, pixels), (np.array(size) - 1) / 2
    usual, fisheye = (
        _fit_lens(points, pixels, sigma, Camera(homography, middle, np.zeros(2), size, kind))
        for kind in (0.0, _FISHEYE[0])
    )
    left, left_fisheye = (
        float(np.median(np.square(one.project(points) - pixels).sum(axis=1)))
        for one in (usual, fisheye)
    )
    return fisheye if left_fisheye < _BETTER * left else usual


def _fit_lens(points: Floats, pixels: Floats, sigma: float, start: Camera) -> Camera:
    """Fits a camera of the kind of the start."""
    size = start.size
    span = np.abs(points - points.mean(axis=0)).max()
    scaling = np.array([1, 1, span, 1, 1, span, 1 / span, 1 / span]) / span
    unit = np.concatenate([scaling * start.scale, np.full(2, start.scale), np.ones(3)])
    unit[6:8] = 1 / span
    middle = (np.array(size) - 1) / 2

    def camera(vector: Floats) -> Camera:
        values = vector * unit
        matrix = np.append(values[:8], 1.0).reshape(3, 3)
        return Camera(matrix, values[8:10], values[10:12], size, values[12] * bool(start.fisheye))

    def residuals(vector: Floats) -> Floats:
        made = camera(vector)
        prior = np.concatenate(
            [
                (made.centre - middle) / (_CENTRE_PRIOR * max(size)),
                made.radial / _DISTORTION_PRIOR,
                [(vector[12] - start.fisheye) / _FISHEYE[1]],
            ]
        )
        return np.concatenate([((made.project(points) - pixels) / sigma).ravel(), prior])

    given = [start.homography.ravel()[:8], start.centre, start.radial, np.array([start.fisheye])]
    first = np.concatenate(given) / unit
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
