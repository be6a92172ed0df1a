"""Fits the templates of all units to a frame."""

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.fit import patch_correlation
from pipeline.tracking.fit.normal_equations import SIZE, FramePixels, workspace
from pipeline.tracking.fit.patch_correlation import FitStart, PoseFits, Templates
from pipeline.tracking.fit.template import block_places
from pipeline.tracking.geometry import Camera
from sim.core import Floats, Mask

FULL_STEPS = 8


class PoseFitter:
    """Fits poses of units to frames of a camera.

    Attributes:
        camera: the camera.
        templates: the units' looks.
        full: (units,) information of each unit seen whole; zero until a first frame is fitted.
    """

    def __init__(self, camera: Camera, templates: Templates, blocks: Floats | None = None) -> None:
        self.camera, self.templates = camera, templates
        self.blocks = block_places(camera) if blocks is None else blocks
        self.full = np.zeros(len(templates.centre))

    def start(self, gain: float) -> tuple[Floats, Floats]:
        """Returns pose and photometry to start from: at rest, all with the same gain."""
        units = len(self.templates.centre)
        return np.zeros((units, 3)), np.tile([gain, 0.0, 0.0, 0.0], (units, 1))

    def fit(
        self,
        image: Picture,
        pose: Floats,
        photometry: Floats,
        chosen: Mask | None = None,
        tight: Floats | None = None,
        noise: Floats | None = None,
        drift: Floats | None = None,
    ) -> PoseFits:
        """Fits the chosen units; NaN for the others and for those that cannot be fitted.

        Args:
            image: the frame.
            pose: (units, 3) where to start.
            photometry: (units, 4) gain, offset and slopes to start from.
            chosen: (units,) which to fit; by default all.
            tight: (units,) scale of the residuals, where photometry and pose are nearly known and
                part of the unit may be hidden.
            noise: (units,) residuals to expect, over the gain, where the pose is nearly known.
            drift: (units, 3) change of the poses from row to row; they are those of the middles'.
        """
        units, place = len(pose), self.templates.centre + pose[:, :2]
        j = self.camera.jacobian(place)
        scale = np.sqrt(np.abs(j[..., 0, 0] * j[..., 1, 1] - j[..., 0, 1] * j[..., 1, 0]))
        start = FitStart(
            np.concatenate([pose, photometry], axis=1),
            self.camera.project(place),
            self.templates.reach * scale * 1.03 + 1,
            scale,
            self.full,
            np.zeros(units) if noise is None else noise,
            np.zeros(units) if tight is None else tight,
            np.zeros((units, 3)) if drift is None else drift,
        )
        wanted = np.isfinite(start.middle[:, 0]) & np.isfinite(scale)
        wanted = wanted if chosen is None else wanted & chosen
        out = np.full((units, patch_correlation.WIDTH), np.nan)
        if wanted.any():
            across = int(2 * start.radius[wanted].max()) // SIZE + 3
            scene = FramePixels(np.ascontiguousarray(image, np.float32), self.blocks)
            patch_correlation.fit_patches(
                scene, self.templates, start, wanted, FULL_STEPS, workspace(across**2), out
            )
        return patch_correlation.unpack(out)
