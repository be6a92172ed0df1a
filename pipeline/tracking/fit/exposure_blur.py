"""Blurs templates as the units' own motion does while a frame is exposed."""

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from pipeline.tracking.fit.patch_correlation import Templates
from pipeline.tracking.fit.template_cells import classify
from sim.core import Floats, Singles

_LEAST = 0.4
"""A way that is not worth a template of its own, px; so is a change of a third of this."""
_PER_PIXEL = 2.0
_MOST = 48


class ExposureBlur:
    """Averages templates over the ways that units go in an exposure, in place.

    Their weights are averaged likewise: the blurred edge reaches farther out, and tells of the
    place wherever the sharp one passes.

    Args:
        templates: as learned at rest.
        pixel: size of a pixel, mm.
    """

    def __init__(self, templates: Templates, pixel: float) -> None:
        self._templates, self._pixel = templates, pixel
        self._sharp = [
            (_filled(face, mask), mask)
            for face, mask in zip(templates.brightness.copy(), templates.weight.copy(), strict=True)
        ]
        self._way = np.zeros((len(self._sharp), 3))

    def redraw(self, way: Floats) -> None:
        """Blurs by ways (units, 3) in mm and rad, in the units' frames, from end to end."""
        arm = np.column_stack([way[:, :2], way[:, 2] * self._templates.reach])
        before = np.column_stack([self._way[:, :2], self._way[:, 2] * self._templates.reach])
        length = np.linalg.norm(arm, axis=1) / self._pixel
        changed = np.linalg.norm(arm - before, axis=1) / self._pixel > _LEAST / 3
        changed &= (length > _LEAST) | (np.linalg.norm(before, axis=1) > 0)
        for unit in np.flatnonzero(changed).tolist():
            self._draw(unit, way[unit] if length[unit] > _LEAST else np.zeros(3), length[unit])

    def _draw(self, unit: int, way: Floats, length: float) -> None:
        self._way[unit] = way
        made = self._templates
        made.brightness[unit], made.weight[unit] = self._sharp[unit]
        if way.any():
            count = int(np.clip(_PER_PIXEL * length, 3, _MOST))
            share = (np.arange(count) + 0.5) / count - 0.5
            faces = [self._moved(self._sharp[unit][0], way * part) for part in share]
            masks = [self._moved(self._sharp[unit][1], way * part) for part in share]
            made.brightness[unit] = np.mean(faces, axis=0)
            made.weight[unit] = np.mean(masks, axis=0)
        classify(
            made.brightness[unit],
            made.weight[unit],
            made.contrast[unit],
            made.noise,
            made.cells.kind[unit],
            made.cells.span[unit],
        )

    def _moved(self, values: Singles, way: Floats) -> Singles:
        """Moves nodes by part of a way; y goes up with the rows, as in the templates."""
        middle, step = values.shape[0] // 2, self._templates.step
        cos, sin = np.cos(way[2]), np.sin(way[2])
        matrix = np.array([[cos, -sin, way[0] / step], [sin, cos, way[1] / step]])
        matrix[:, 2] += middle - matrix[:, :2] @ [middle, middle]
        return np.asarray(
            cv2.warpAffine(
                values,
                matrix,
                values.shape[::-1],
                flags=cv2.INTER_CUBIC if values.min() < 0 or values.max() > 1 else cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            ),
            np.float32,
        )


def _filled(face: Singles, weight: Singles) -> Singles:
    """Continues a face (rows, columns) outwards, where it has no weight, by its nearest nodes."""
    near = distance_transform_edt(weight <= 0, return_distances=False, return_indices=True)
    return np.asarray(face[tuple(near)], np.float32)
