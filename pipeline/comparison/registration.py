"""Registers the measured places of the units at rest: a rigid motion and a scale.

The rigid part is taken out of what is compared, the scale left in. By the camera of a track it is 1
whatever was printed, as that camera is fitted to the same units where the design has them.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.tracking.geometry import camera_of
from sim.core import Floats

_LEAST = 3  # units


class Registration(NamedTuple):
    """Maps the design's places to the measured ones, with standard uncertainties."""

    rotation: float  # counter-clockwise, rad
    shift: Floats  # (2,) of the specimen's middle, mm
    scale: float  # measured over designed distances
    rotation_sigma: float  # from the scatter of the units
    shift_sigma: Floats  # likewise
    scale_sigma: float
    residual: float  # root mean square distance that it leaves, mm

    def upright(self, motion: Floats) -> Floats:
        """Turns motions (..., 3) back into the design's frame."""
        cos, sin = np.cos(self.rotation), np.sin(self.rotation)
        turned = motion[..., :2] @ np.array([[cos, -sin], [sin, cos]])
        return np.concatenate([turned, motion[..., 2:]], axis=-1)


UNREGISTERED = Registration(
    0.0, np.full(2, np.nan), np.nan, np.nan, np.full(2, np.nan), np.nan, np.nan
)
"""Of a track that does not tell where its units were at rest."""


def register(design: Floats, measured: Floats) -> Registration:
    """Fits a similarity (least squares) between places (units, 2) in mm; NaN: unknown."""
    known = np.isfinite(design).all(axis=1) & np.isfinite(measured).all(axis=1)
    if known.sum() < _LEAST:
        return UNREGISTERED
    middle = design[known].mean(axis=0)
    before, after = _complex(design[known] - middle), _complex(measured[known] - middle)
    shift = after.mean()
    spread = float(np.sum(np.abs(before) ** 2))
    factor = np.sum(np.conj(before) * (after - shift)) / spread
    square = np.abs(after - shift - factor * before) ** 2
    variance = float(square.sum()) / max(2 * len(before) - 4, 1)
    turn_sigma = np.sqrt(variance / spread)
    return Registration(
        rotation=float(np.angle(factor)),
        shift=np.array([shift.real, shift.imag]),
        scale=float(np.abs(factor)),
        rotation_sigma=float(turn_sigma / np.abs(factor)),
        shift_sigma=np.full(2, np.sqrt(variance / len(before))),
        scale_sigma=float(turn_sigma),
        residual=float(np.sqrt(square.mean())),
    )


def measure_places(track: xr.Dataset, design: Floats) -> Floats:
    """Computes the places of the units at rest (units, 2) by the camera, mm; NaN if unseen.

    `design` (units, 2) is where they should be, NaN for those that are absent.
    """
    measured = np.full_like(design, np.nan)
    camera, missed = camera_of(track), track["camera_residual"].values
    if camera is not None:
        there = np.isfinite(design + missed).all(axis=1)
        measured[there] = camera.unproject(camera.project(design[there]) + missed[there])
    return measured


def pixel_size(track: xr.Dataset, middle: Floats) -> float:
    """Computes the size of a pixel at a place (2,) by the camera, mm; NaN without one."""
    if (camera := camera_of(track)) is None:
        return np.nan
    return float(1 / np.sqrt(abs(np.linalg.det(camera.jacobian(middle)))))


def _complex(points: Floats) -> np.ndarray:
    return np.asarray(points[:, 0] + 1j * points[:, 1])
