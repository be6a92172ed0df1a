"""Fits the camera that sees known points of a plane, and sigma points of its covariance."""

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.optimize import least_squares

from pipeline.tracking.geometry.camera import Camera
from pipeline.tracking.geometry.homography import fit_homography
from sim.core import Floats, Reals

_CENTRE_PRIOR = 0.03
"""Standard deviation of the distortion's centre about the middle of the image, in image sizes."""
_USUAL_DISTORTION = 0.02
"""Scale of the prior of the radial coefficients, whose tails are Cauchy's: most lenses bend by some
per cent at most, and few by a third."""
_FISHEYE = (0.7, 0.5)
"""A usual one, from which to start, and the standard deviation of the prior."""
_RESIDUAL_RATIO = 0.6
"""A fisheye's squared residuals must be so much smaller than those of the usual lens."""
_MAD, _TINY = 1.4826, 1e-9
_NODES, _STEP = 48, 0.5
"""Of a grid over the places of a specimen, each way; mm of a difference."""
_BLOCK = 128
"""Frames whose variances are computed at once: long recordings need no more memory."""


def fit_camera(
    points: Floats, pixels: Floats, size: tuple[int, int], sigma: float, start: Camera | None = None
) -> Camera:
    """Fits the camera that sees the points at the pixels, by robust least squares.

    The usual lens is taken, unless a fisheye leaves much less of a residual; a start has one kind.

    Args:
        points: (n, 2) mm, at least four, not on a line.
        pixels: (n, 2) where they are seen.
        size: of the image, px.
        sigma: standard uncertainty of the pixels; weighs the prior of centre and distortion (both
            near the middle, little) and tells outliers.
        start: a camera near the solution; by default the best homography.
    """
    if start is not None:
        return _CameraFit(points, pixels, sigma, start).fit()
    homography, middle = fit_homography(points, pixels), (np.array(size) - 1) / 2
    usual, fisheye = (
        _CameraFit(points, pixels, sigma, Camera(homography, middle, np.zeros(2), size, kind)).fit()
        for kind in (0.0, _FISHEYE[0])
    )
    left, left_fisheye = (
        float(np.median(np.square(one.project(points) - pixels).sum(axis=1)))
        for one in (usual, fisheye)
    )
    return fisheye if left_fisheye < _RESIDUAL_RATIO * left else usual


def pixel_noise(points: Floats, pixels: Floats, camera: Camera) -> float:
    """Estimates the standard deviation of pixels (n, 2) about where a fitted camera sees points."""
    off = camera.project(points) - pixels
    free = max(off.size - _CameraFit.count, 1) / off.size
    return _MAD * float(np.median(np.abs(off))) / np.sqrt(free)


def sigma_point_cameras(points: Floats, pixels: Floats, camera: Camera) -> list[Camera]:
    """Returns the sigma points of a fitted camera: a deviation along each axis of its covariance.

    What each of them makes of a picture, less what the fitted one does, is an independent error.
    """
    lens = _CameraFit(points, pixels, max(pixel_noise(points, pixels, camera), 1e-9), camera)
    return lens.sigma_points()


def lens_variance(
    camera: Camera, sigma_points: list[Camera], centre: Floats, motion: Reals
) -> Iterator[tuple[slice, Floats]]:
    """Yields blocks of frames, and variances (frames, units, 3) by the camera's uncertainty.

    Away from where it was fitted its distortion is extrapolated, and a unit that travels through
    the picture seems to move by the change of that error. Variances are in mm^2 and rad^2.

    Args:
        camera: by which the motions were found.
        sigma_points: others that are a standard deviation off, each by an error of its own.
        centre: (units, 2) places at rest, mm.
        motion: (frames, units, 3) from there, NaN where missing.
    """
    blocks = [slice(first, first + _BLOCK) for first in range(0, len(motion), _BLOCK)]
    bounds = [centre.min(axis=0), centre.max(axis=0)]
    for block in blocks:
        now = (centre + motion[block, :, :2])[np.isfinite(motion[block, :, 0])]
        bounds += [now.min(axis=0, initial=np.inf), now.max(axis=0, initial=-np.inf)]
    low, high = np.min(bounds, axis=0), np.max(bounds, axis=0)
    nodes = np.stack(np.meshgrid(*np.linspace(low, high, _NODES).T, indexing="ij"), axis=-1)
    cells = np.maximum(high - low, 1e-9) / (_NODES - 1)
    there = (centre - low).T / cells[:, None]
    fields = [
        [(field, map_coordinates(field, there, order=1)) for field in errors]
        for errors in _projection_errors(camera, sigma_points, nodes)
    ]
    for block in blocks:
        known = np.isfinite(motion[block, :, 0])
        unit = np.nonzero(known)[1]
        here = (centre[unit] + motion[block][known][:, :2] - low).T / cells[:, None]
        total = np.zeros((len(unit), 3))
        for errors in fields:
            for dof, (field, rest) in enumerate(errors):
                total[:, dof] += (map_coordinates(field, here, order=1) - rest[unit]) ** 2
        out = np.full((*known.shape, 3), np.nan)
        out[known] = total
        yield block, out


class _CameraFit:
    """Scales the parameters of a camera, and computes residuals of what it sees and of its prior.

    The camera is of the kind of the start.
    """

    count = 12

    def __init__(self, points: Floats, pixels: Floats, sigma: float, start: Camera) -> None:
        self._points, self._pixels, self._sigma, self._start = points, pixels, sigma, start
        span = np.abs(points - points.mean(axis=0)).max()
        scaling = np.array([1, 1, span, 1, 1, span, 1 / span, 1 / span]) / span
        self._unit = np.concatenate([scaling * start.scale, np.full(2, start.scale), np.ones(3)])
        self._unit[6:8] = 1 / span
        matrix, fisheye = start.homography.ravel()[:8], np.array([start.fisheye])
        self._first = np.concatenate([matrix, start.centre, start.radial, fisheye]) / self._unit

    def fit(self) -> Camera:
        """Fits it by robust least squares."""
        near = self._minimise(self._first)
        return self._camera(self._minimise(near, loss="soft_l1", f_scale=3.0))

    def sigma_points(self) -> list[Camera]:
        """Returns the start moved along each axis of its covariance, the inverse of J^T J."""
        _, size, axes = np.linalg.svd(self._jacobian(self._first), full_matrices=False)
        return [self._camera(self._first + axis / s) for s, axis in zip(size, axes, strict=True)]

    def _minimise(self, start: Floats, **loss: str | float) -> Floats:
        found = least_squares(
            self._residuals, start, self._jacobian, x_scale="jac", xtol=1e-12, **loss
        )
        return np.asarray(found.x)

    def _camera(self, vector: Floats) -> Camera:
        values, start = vector * self._unit, self._start
        matrix = np.append(values[:8], 1.0).reshape(3, 3)
        fisheye = values[12] * bool(start.fisheye)
        return Camera(matrix, values[8:10], values[10:12], start.size, fisheye)

    def _residuals(self, vector: Floats) -> Floats:
        made, start = self._camera(vector), self._start
        off = ((made.project(self._points) - self._pixels) / self._sigma).ravel()
        aside = (made.centre - (np.array(start.size) - 1) / 2) / (_CENTRE_PRIOR * max(start.size))
        bent = made.radial / _USUAL_DISTORTION
        bent = np.sign(bent) * np.sqrt(np.log1p(bent**2))
        return np.concatenate([off, aside, bent, [(vector[12] - start.fisheye) / _FISHEYE[1]]])

    def _jacobian(self, vector: Floats) -> Floats:
        """Differentiates the residuals after the scaled parameters."""
        made, start = self._camera(vector), self._start
        prior = np.zeros((5, len(vector)))
        prior[[0, 1], [8, 9]] = 1 / (_CENTRE_PRIOR * max(start.size))
        bent = np.maximum(np.abs(made.radial) / _USUAL_DISTORTION, _TINY)
        steep = bent / np.sqrt(np.log1p(bent**2)) / (1 + bent**2)
        prior[[2, 3], [10, 11]] = steep / _USUAL_DISTORTION
        prior[4, 12] = 1 / _FISHEYE[1]
        seen = made.parameter_slopes(self._points) / self._sigma
        seen[..., 12] *= bool(start.fisheye)
        return np.concatenate([seen.reshape(-1, len(vector)), prior]) * self._unit


def _projection_errors(camera: Camera, others: list[Camera], places: Floats) -> Iterator[Floats]:
    """Yields the errors (3, ...) of shift and rotation at places (..., 2) by each other camera."""
    x, y = np.array([_STEP, 0.0]), np.array([0.0, _STEP])
    around = [places, places + x, places - x, places + y, places - y]
    seen = [(camera.project(at), camera.jacobian(at)) for at in around]  # for all the others
    for other in others:
        here, right, left, up, down = (
            np.linalg.solve(slopes, (other.project(at) - pixels)[..., None])[..., 0]
            for at, (pixels, slopes) in zip(around, seen, strict=True)
        )
        turn = ((right - left)[..., 1] - (up - down)[..., 0]) / (4 * _STEP)
        yield np.concatenate([np.moveaxis(here, -1, 0), [turn]])
