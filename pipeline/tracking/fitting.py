"""Fits the templates of all units to a frame."""

from __future__ import annotations

import numpy as np

from pipeline.tracking import patch
from pipeline.tracking.arrays import Floats, Image, Mask, Singles
from pipeline.tracking.camera import Camera
from pipeline.tracking.patch import Fits, Templates
from pipeline.tracking.template import plane_of

FULL_STEPS = 8
_FLOOR = 0.04
"""Smallest scale of the robust weights, in contrasts of the unit."""


class Fitter:
    """A camera and what it should see.

    Attributes:
        camera: the camera.
        templates: the units' looks.
        full: (units,) information of each unit seen whole; zero until a first frame is fitted.
    """

    def __init__(self, camera: Camera, templates: Templates, plane: Singles | None = None) -> None:
        self.camera, self.templates = camera, templates
        self.plane = plane_of(camera) if plane is None else plane
        self.full = np.zeros(len(templates.centre))
        self._grid = np.array([templates.half, templates.step])

    def start(self, gain: float) -> tuple[Floats, Floats]:
        """Pose and photometry to start from: at rest, all with the same gain."""
        units = len(self.templates.centre)
        return np.zeros((units, 3)), np.tile([gain, 0.0, 0.0, 0.0], (units, 1))

    def fit(
        self,
        image: Image,
        pose: Floats,
        photometry: Floats,
        chosen: Mask | None = None,
        tight: Floats | None = None,
    ) -> Fits:
        """Poses of the chosen units, NaN for the others and for those that cannot be fitted.

        Args:
            image: the frame.
            pose: (units, 3) where to start.
            photometry: (units, 4) gain, offset and slopes to start from.
            chosen: (units,) which to fit; by default all.
            tight: (units,) scale of the residuals, where photometry and pose are nearly known and
                part of the unit may be hidden.
        """
        templates = self.templates
        place = templates.centre + pose[:, :2]
        middle, jacobian = self.camera.project(place), self.camera.jacobian(place)
        px = np.sqrt(np.abs(_determinant(jacobian)))
        out = np.full((len(pose), patch.WIDTH), np.nan)
        wanted = np.isfinite(middle[:, 0]) & np.isfinite(px)
        patch.fit(
            image,
            self.plane,
            templates.coefs,
            templates.weight,
            self._grid,
            templates.centre,
            templates.contrast,
            self.full,
            np.concatenate([pose, photometry], axis=1),
            middle,
            templates.reach * px * 1.03 + 1,
            px,
            wanted if chosen is None else wanted & chosen,
            FULL_STEPS,
            _FLOOR,
            np.zeros(len(pose)) if tight is None else tight,
            out,
        )
        return patch.unpack(out)


def _determinant(matrices: Floats) -> Floats:
    return matrices[..., 0, 0] * matrices[..., 1, 1] - matrices[..., 0, 1] * matrices[..., 1, 0]
