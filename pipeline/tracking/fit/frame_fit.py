"""Fits the templates of all units to a frame, parts of them side by side."""

import itertools
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.fit import patch_correlation
from pipeline.tracking.fit.compared_pixels import SIZE, FramePixels, pixel_lists
from pipeline.tracking.fit.normal_equations import fit_buffers
from pipeline.tracking.fit.patch_correlation import FitStart, PoseFits, Templates
from pipeline.tracking.fit.template import block_places
from pipeline.tracking.fit.template_cells import TemplateCells
from pipeline.tracking.geometry import Camera
from sim.core import Floats, Mask

FULL_STEPS = 8
_THREADS = min(4, cv2.getNumberOfCPUs())
_FEWEST = 16
"""Units that are worth a thread of their own."""


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
        self._threads = ThreadPoolExecutor(_THREADS)

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
            scene = FramePixels(np.ascontiguousarray(image, np.float32), self.blocks)
            parts = [
                self._threads.submit(self._fit_part, scene, start, wanted, out, part)
                for part in _shares(wanted)
            ]
            for done in parts:
                done.result()
        return patch_correlation.unpack(out)

    def _fit_part(
        self, scene: FramePixels, start: FitStart, wanted: Mask, out: Floats, part: slice
    ) -> None:
        """Fills the rows of a part of the units; loops over pixels hold no interpreter's lock."""
        begin = FitStart(*(values[part] for values in start))
        across = int(2 * begin.radius[wanted[part]].max()) // SIZE + 3
        looks = _part_of(self.templates, part)
        lists = pixel_lists(across**2)
        room = fit_buffers(len(lists.x), looks.weight[0].size)
        patch_correlation.fit_patches(
            scene, looks, begin, wanted[part], FULL_STEPS, lists, room, out[part]
        )


def _part_of(looks: Templates, units: slice) -> Templates:
    """Returns the templates of some of the units; arrays are shared."""
    return looks._replace(
        brightness=looks.brightness[units],
        weight=looks.weight[units],
        centre=looks.centre[units],
        contrast=looks.contrast[units],
        reach=looks.reach[units],
        cells=TemplateCells(looks.cells.kind[units], looks.cells.span[units]),
    )


def _shares(wanted: Mask) -> list[slice]:
    """Splits units (units,) into ranges with about as many to be fitted in each."""
    places = np.flatnonzero(wanted)
    count = max(1, min(_THREADS, len(places) // _FEWEST))
    ends = [0, *(int(part[0]) for part in np.array_split(places, count)[1:]), len(wanted)]
    return [slice(*pair) for pair in itertools.pairwise(ends)]
