"""Fits the templates of all units to a frame, parts of them side by side."""

import itertools
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.fit import patch_correlation
from pipeline.tracking.fit.compared_pixels import FramePixels
from pipeline.tracking.fit.patch_correlation import FitStart, PoseFits, Templates
from pipeline.tracking.fit.template import block_places
from pipeline.tracking.fit.template_cells import TemplateCells
from pipeline.tracking.geometry import Camera
from sim.core import Floats, Mask, Singles

FULL_STEPS = 8
_THREADS = min(4, cv2.getNumberOfCPUs())
_UNITS_PER_TASK = 16
"""Units that a thread takes at once; the rest is left to whichever thread is free first."""


class PoseFitter:
    """Fits poses of units to frames of a camera.

    Attributes:
        camera: the camera.
        templates: the units' appearance.
        full: (units,) information of each unit seen whole; zero until a first frame is fitted.
    """

    def __init__(self, camera: Camera, templates: Templates, blocks: Floats | None = None) -> None:
        self.camera, self.templates = camera, templates
        self.blocks = block_places(camera) if blocks is None else blocks
        self.full = np.zeros(len(templates.centre))
        self._threads = ThreadPoolExecutor(_THREADS)
        self._singles = np.zeros((0, 0), np.float32)

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
        values = (
            np.concatenate([pose, photometry], axis=1),
            self.camera.project(place),
            self.templates.reach * scale * 1.03 + 1,
            scale,
            self.full,
            np.zeros(units) if noise is None else noise,
            np.zeros(units) if tight is None else tight,
            np.zeros((units, 3)) if drift is None else drift,
        )
        start = FitStart(*(np.ascontiguousarray(each, np.float64) for each in values))
        selected = np.isfinite(start.middle[:, 0]) & np.isfinite(scale)
        selected = selected if chosen is None else selected & chosen
        out = np.full((units, patch_correlation.WIDTH), np.nan)
        if selected.any():
            scene = FramePixels(self._as_singles(image), image.shape[1], self.blocks)
            parts = _partition(selected)
            remaining, others = iter(parts), min(_THREADS, len(parts)) - 1
            pending = [
                self._threads.submit(self._fit_parts, scene, start, selected, out, remaining)
                for _ in range(others)
            ]
            self._fit_parts(scene, start, selected, out, remaining)
            for done in pending:
                done.result()
        return patch_correlation.unpack(out)

    def _as_singles(self, image: Picture) -> Singles:
        """Returns the picture in single precision, in memory that all frames share.

        The system clears new memory of this size page by page, which takes longer than the copy.
        """
        if image.dtype == np.float32:
            return np.ascontiguousarray(image, np.float32)
        if self._singles.shape != image.shape:
            self._singles = np.zeros(image.shape, np.float32)
        np.copyto(self._singles, image)
        return self._singles

    def _fit_parts(
        self,
        scene: FramePixels,
        start: FitStart,
        selected: Mask,
        out: Floats,
        remaining: Iterator[slice],
    ) -> None:
        """Fills the rows of parts of the units as long as some are left, which threads share.

        Loops over pixels hold no interpreter's lock.
        """
        size = self.templates.weight.shape[1]
        for part in remaining:
            begin = FitStart(*(values[part] for values in start))
            templates = _subset(self.templates, part)
            patch_correlation.fit_patches(
                scene, templates, begin, selected[part], size, FULL_STEPS, out[part]
            )


def _subset(templates: Templates, units: slice) -> Templates:
    """Returns the templates of some of the units; arrays are shared."""
    return templates._replace(
        brightness=templates.brightness[units],
        weight=templates.weight[units],
        centre=templates.centre[units],
        contrast=templates.contrast[units],
        reach=templates.reach[units],
        cells=TemplateCells(templates.cells.kind[units], templates.cells.span[units]),
    )


def _partition(selected: Mask) -> list[slice]:
    """Splits units (units,) into ranges with about as many to be fitted in each."""
    places = np.flatnonzero(selected)
    count = max(1, len(places) // _UNITS_PER_TASK)
    ends = [0, *(int(part[0]) for part in np.array_split(places, count)[1:]), len(selected)]
    return [slice(*pair) for pair in itertools.pairwise(ends)]
