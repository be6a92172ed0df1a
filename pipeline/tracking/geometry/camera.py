"""Maps the specimen's plane to pixels and back: homography and radial distortion about a centre.

For a flat specimen this is the pinhole camera with radial distortion, whatever its pose and focal
length (Zhang, IEEE TPAMI 22 (2000) 1330). A fisheye maps the angle to its axis, not the tangent, to
the radius (Kannala and Brandt, IEEE TPAMI 28 (2006) 1335, as OpenCV has it). Pixels count from the
centre of the top left one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.tracking.geometry.homography import fit_homography
from sim.core import Floats

_INVERSE_STEPS = 8
_TINY, _SMALL = 1e-9, 1e-3
_STEEPEST = 1.55
"""Angle to the axis of a fisheye beyond which nothing of a plane is seen, rad."""


class _Radial(NamedTuple):
    """Holds the distortion at some offsets from its centre."""

    gain: Floats  # (..., 1) by which it lengthens them
    slope: Floats  # (..., 1) of the gain along the offset, over the offset, 1/px^2
    slopes: Floats  # (..., 1, 3) of the gain after both radial coefficients and the fisheye's


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
        offset = self._flat(points)[0] - self.centre
        return np.asarray(self.centre + offset * self._radial(offset).gain)

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
        flat, depth = self._flat(points)
        h = self.homography
        slope = (h[:2, :2] - flat[..., None] * h[2, :2]) / depth[..., None]
        offset = flat - self.centre
        return np.asarray(_bent(offset, self._radial(offset)) @ slope)

    def parameter_slopes(self, points: Floats) -> Floats:
        """Differentiates (..., 2, 13) the pixels after the parameters.

        These are the homography row by row but its last entry, the centre, the radial coefficients
        and the fisheye's.
        """
        flat, depth = self._flat(points)
        offset = flat - self.centre
        radial = self._radial(offset)
        bent = _bent(offset, radial)
        seen = np.append(points, np.ones((*points.shape[:-1], 1)), axis=-1) / depth
        rows = (bent[..., k, None] * seen[..., None, :] for k in range(2))
        last = -(bent @ flat[..., None]) * seen[..., None, :2]
        lens = offset[..., None] * radial.slopes
        return np.concatenate([*rows, last, np.eye(2) - bent, lens], axis=-1)

    def _flat(self, points: Floats) -> tuple[Floats, Floats]:
        """Maps points (..., 2) to pixels without distortion, and divides by (..., 1)."""
        h = self.homography
        depth = (points @ h[2, :2] + h[2, 2])[..., None]
        return (points @ h[:2, :2].T + h[:2, 2]) / depth, depth

    def _radial(self, offset: Floats) -> _Radial:
        """Computes what distortion makes of offsets (..., 2) from its centre.

        Its gain g(s) = r (1 + k1 t + k2 t^2) for the square s of the radius, where a fisheye f has
        r = atan(m) / m, m = f sqrt(s) and t = s r^2, and another lens r = 1.
        """
        (first, second), fisheye = self.radial, self.fisheye
        square = np.sum((offset / self.scale) ** 2, axis=-1, keepdims=True)
        m = np.maximum(fisheye * np.sqrt(square), _TINY)
        ratio = np.arctan(m) / m if fisheye else np.ones_like(square)
        t = square * ratio**2
        bend, steeper = 1 + t * (first + t * second), first + 2 * t * second
        # f^2 curl is twice the slope of r after s, and f s curl its slope after f
        close = -2 / 3 + 4 / 5 * m**2
        curl = np.where(m < _SMALL, close, (1 / (1 + m**2) - ratio) / m**2)
        after_square, after_fisheye = fisheye**2 * curl / 2, fisheye * square * curl
        chain = bend + 2 * t * steeper  # of the gain after r
        slope = chain * after_square + ratio**3 * steeper
        lens = [ratio * t, ratio * t**2, chain * after_fisheye]
        return _Radial(
            ratio * bend, 2 * slope / self.scale**2, np.concatenate(lens, axis=-1)[..., None, :]
        )

    def px_per_mm(self, points: Floats) -> Floats:
        """Returns the scale (...) at points (..., 2), px/mm."""
        return np.asarray(np.sqrt(np.abs(np.linalg.det(self.jacobian(points)))))


def _bent(offset: Floats, radial: _Radial) -> Floats:
    """Differentiates (..., 2, 2) the pixels after those without distortion."""
    outer = offset[..., :, None] * offset[..., None, :]
    return np.asarray(radial.gain[..., None] * np.eye(2) + radial.slope[..., None] * outer)


def camera_of(dataset: xr.Dataset) -> Camera | None:
    """Reads the camera that a track was made with; points of another system come without."""
    homography = dataset["camera_homography"].values
    if np.isnan(homography).any():
        return None
    width, height = dataset["image_size"].values.tolist()
    first, second, *fisheye = dataset["camera_radial"].values.tolist()
    centre = dataset["camera_centre"].values
    return Camera(homography, centre, np.array([first, second]), (width, height), *fisheye)
