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

from pipeline.tracking.geometry.homography import fit_homography
from sim.core import Floats

_NEWTON_STEPS = 8
_TINY, _SMALL = 1e-9, 1e-6
_STEEPEST = 1.55
"""Angle to the axis of a fisheye beyond which nothing of a plane is seen, rad."""


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
        offset = self._project_pinhole(points)[0] - self.centre
        return np.asarray(self.centre + offset * self._distortion_gain(*self._radius(offset)))

    def unproject(self, pixels: Floats) -> Floats:
        """Maps pixels (..., 2) to points (..., 2) of the plane in mm."""
        offset = (pixels - self.centre) * self._undistorting(pixels)[..., None]
        inverse = np.linalg.inv(self.homography)
        flat = offset + self.centre
        points = flat @ inverse[:2, :2].T + inverse[:2, 2]
        return points / (flat @ inverse[2, :2] + inverse[2, 2])[..., None]

    def resected(self, points: Floats, pixels: Floats) -> Camera:
        """Returns a resection by the same lens, whose homography maps points (n, 2) to pixels."""
        ratio = self._undistorting(pixels)[..., None]
        flat = self.centre + (pixels - self.centre) * ratio
        return replace(self, homography=fit_homography(points, flat))

    def binned(self, factor: int) -> Camera:
        """Returns the same of pictures in which blocks of pixels are averaged, whole ones alone.

        A pixel p becomes (p + 1/2) / factor - 1/2.
        """
        width, height = (size // factor for size in self.size)
        shift = (1 / factor - 1) / 2
        onto = np.array([[1 / factor, 0.0, shift], [0.0, 1 / factor, shift], [0.0, 0.0, 1.0]])
        made = replace(self, homography=onto @ self.homography, size=(width, height))
        unit = made.scale * factor / self.scale  # of the radius, where blocks are cut off
        return replace(
            made,
            centre=self.centre / factor + shift,
            radial=self.radial * np.array([unit**2, unit**4]),
            fisheye=self.fisheye * unit,
        )

    def _undistorting(self, pixels: Floats) -> Floats:
        """Solves for the radius (...) without distortion over that with it, by Newton's method."""
        first, second = self.radial
        x, y = np.moveaxis((pixels - self.centre) / self.scale, -1, 0)
        seen = np.maximum(np.sqrt(x**2 + y**2), 1e-12)
        radius = seen
        for _ in range(_NEWTON_STEPS):
            square = radius**2
            excess = radius * (1 + square * (first + square * second)) - seen
            radius = radius - excess / (1 + square * (3 * first + square * 5 * second))
        if self.fisheye:
            angle = np.minimum(self.fisheye * radius, _STEEPEST)
            radius = radius * np.tan(angle) / np.maximum(angle, _TINY)
        return np.asarray(radius / seen)

    def jacobian(self, points: Floats) -> Floats:
        """Differentiates (..., 2, 2) the pixels after the points, px/mm."""
        flat, depth = self._project_pinhole(points)
        h = self.homography
        slope = (h[:2, :2] - flat[..., None] * h[2, :2]) / depth[..., None]
        offset = flat - self.centre
        return np.asarray(self._distortion_jacobian(offset, *self._radius(offset)) @ slope)

    def parameter_slopes(self, points: Floats) -> Floats:
        """Differentiates (..., 2, 13) the pixels after the parameters.

        These are the homography row by row but its last entry, the centre, the radial coefficients
        and the fisheye's.
        """
        flat, depth = self._project_pinhole(points)
        offset = flat - self.centre
        radius = self._radius(offset)
        bent = self._distortion_jacobian(offset, *radius)
        seen = np.append(points, np.ones((*points.shape[:-1], 1)), axis=-1) / depth
        rows = (bent[..., k, None] * seen[..., None, :] for k in range(2))
        last = -(bent @ flat[..., None]) * seen[..., None, :2]
        lens = offset[..., None] * self._lens_slopes(*radius)[..., None, :]
        return np.concatenate([*rows, last, np.eye(2) - bent, lens], axis=-1)

    def _project_pinhole(self, points: Floats) -> tuple[Floats, Floats]:
        """Maps points (..., 2) to pixels without distortion, and divides by (..., 1)."""
        h = self.homography
        depth = (points @ h[2, :2] + h[2, 2])[..., None]
        return (points @ h[:2, :2].T + h[:2, 2]) / depth, depth

    def _radius(self, offset: Floats) -> tuple[Floats, Floats]:
        """Computes of offsets (..., 2) from the centre the square s (..., 1) of the radius, and r.

        A fisheye f has r = atan(m) / m with m = f sqrt(s), another lens r = 1.
        """
        scaled = offset / self.scale
        square = scaled[..., :1] ** 2 + scaled[..., 1:] ** 2  # a sum over an axis of two is slow
        if not self.fisheye:
            return square, np.ones_like(square)
        m = np.maximum(self.fisheye * np.sqrt(square), _TINY)
        return square, np.arctan(m) / m

    def _distortion_gain(self, square: Floats, ratio: Floats) -> Floats:
        """Computes r (1 + k1 t + k2 t^2), t = s r^2, by which distortion lengthens an offset."""
        t = square * ratio**2
        return np.asarray(ratio * (1 + t * (self.radial[0] + t * self.radial[1])))

    def _gain_slopes(self, square: Floats, ratio: Floats) -> tuple[Floats, Floats]:
        """Differentiates the gain after r, and r after s: twice the latter over f^2."""
        t = square * ratio**2
        m2 = self.fisheye**2 * square
        close = -2 / 3 + 4 / 5 * m2
        curl = np.where(m2 < _SMALL, close, (1 / (1 + m2) - ratio) / np.maximum(m2, _SMALL))
        return 1 + t * (3 * self.radial[0] + 5 * t * self.radial[1]), curl

    def _distortion_jacobian(self, offset: Floats, square: Floats, ratio: Floats) -> Floats:
        """Differentiates (..., 2, 2) the pixels after those without distortion."""
        after_ratio, curl = self._gain_slopes(square, ratio)
        steeper = self.radial[0] + 2 * square * ratio**2 * self.radial[1]
        slope = after_ratio * self.fisheye**2 * curl / 2 + ratio**3 * steeper
        outer = offset[..., :, None] * offset[..., None, :] * (2 / self.scale**2)
        return (
            self._distortion_gain(square, ratio)[..., None] * np.eye(2) + slope[..., None] * outer
        )

    def _lens_slopes(self, square: Floats, ratio: Floats) -> Floats:
        """Differentiates (..., 3) the gain after both radial coefficients and the fisheye's."""
        t = square * ratio**2
        after_ratio, curl = self._gain_slopes(square, ratio)
        fisheye = after_ratio * self.fisheye * square * curl
        return np.concatenate([ratio * t, ratio * t**2, fisheye], axis=-1)

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
