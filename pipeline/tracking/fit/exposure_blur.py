"""Blurs templates as the units' own motion does while a frame is exposed."""

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from pipeline.tracking.fit.patch_correlation import Templates
from pipeline.tracking.fit.template_cells import classify
from sim.core import Floats, Mask, Reals, Singles

_SHORTEST = 0.4
"""Motion in an exposure, px, not worth a template of its own; so is a change by a third of it."""
_SAMPLES_PER_PIXEL = 2.0
_MOST_SAMPLES = 48


class ExposureBlur:
    """Averages templates over the units' motions in an exposure, in place.

    Their weights are averaged likewise: the blurred edge reaches farther out, and tells of the
    place wherever the sharp one passes.

    A picture shows more of a unit's acceleration than none: the mean of its shifts over the
    exposure, weighed by how much each instant tells of the place. An edge that is blurred far tells
    least at its ends.

    Args:
        templates: as learned at rest.
        pixel: size of a pixel, mm.

    Attributes:
        share: (units, 2) what shows of an acceleration along the motion, and about the middle, over
            the mean of its shifts.
    """

    def __init__(self, templates: Templates, pixel: float) -> None:
        self._templates, self._pixel = templates, pixel
        self._sharp = [
            (_extrapolated(face, mask), mask)
            for face, mask in zip(templates.brightness.copy(), templates.weight.copy(), strict=True)
        ]
        self._travel = np.zeros((len(self._sharp), 3))
        self.share = np.ones((len(self._sharp), 2), np.float16)

    def redraw(self, travel: Floats, chosen: Mask | None = None) -> None:
        """Blurs by motions (units, 3) in mm and rad, in the units' frames, from end to end.

        Units that are not ``chosen`` (by default all are) stay as they are.
        """
        arm = np.column_stack([travel[:, :2], travel[:, 2] * self._templates.reach])
        before = np.column_stack([self._travel[:, :2], self._travel[:, 2] * self._templates.reach])
        length = np.linalg.norm(arm, axis=1) / self._pixel
        changed = np.linalg.norm(arm - before, axis=1) / self._pixel > _SHORTEST / 3
        changed &= (length > _SHORTEST) | (np.linalg.norm(before, axis=1) > 0)
        if chosen is not None:
            changed &= chosen
        for unit in np.flatnonzero(changed).tolist():
            self._draw(
                unit, travel[unit] if length[unit] > _SHORTEST else np.zeros(3), length[unit]
            )

    def _draw(self, unit: int, travel: Floats, length: float) -> None:
        self._travel[unit] = travel
        made = self._templates
        made.brightness[unit], made.weight[unit] = self._sharp[unit]
        self.share[unit] = 1.0
        if travel.any():
            count = int(np.clip(_SAMPLES_PER_PIXEL * length, 3, _MOST_SAMPLES))
            share = (np.arange(count) + 0.5) / count - 0.5
            faces, masks = (self._warped(each, travel, share) for each in self._sharp[unit])
            made.brightness[unit] = np.mean(faces, axis=0)
            made.weight[unit] = np.mean(masks, axis=0)
            bent = np.average(faces, axis=0, weights=share**2)
            self.share[unit] = _acceleration_share(
                made.brightness[unit], bent, made.weight[unit], travel
            )
        classify(
            made.brightness[unit],
            made.weight[unit],
            made.contrast[unit],
            made.noise,
            made.cells.kind[unit],
            made.cells.span[unit],
        )

    def _warped(self, values: Singles, travel: Floats, share: Floats) -> Singles:
        """Warps a template by parts of a motion; y goes up with the rows, as in the templates."""
        middle, step = values.shape[0] // 2, self._templates.step
        kind = cv2.INTER_CUBIC if values.min() < 0 or values.max() > 1 else cv2.INTER_LINEAR
        out = np.empty((len(share), *values.shape), np.float32)
        for each, (x, y, turn) in zip(out, share[:, None] * travel, strict=True):
            cos, sin = np.cos(turn), np.sin(turn)
            matrix = np.array([[cos, -sin, x / step], [sin, cos, y / step]])
            matrix[:, 2] += middle - matrix[:, :2] @ [middle, middle]
            size, border = values.shape[::-1], cv2.BORDER_REPLICATE
            cv2.warpAffine(values, matrix, size, dst=each, flags=kind, borderMode=border)
        return out


def _acceleration_share(face: Reals, bent: Reals, weight: Reals, travel: Floats) -> Floats:
    """Fits the shares of accelerations along a motion (3,) and about the middle in a blurred face.

    Instants t of an exposure T shift the face by a t^2 / 2, in the mean a T^2 / 24; ``bent`` is the
    mean face with weights t^2 over their mean.
    """
    line = np.arange(len(face)) - len(face) // 2
    used = weight > 0
    x, y = (np.broadcast_to(one, face.shape)[used] for one in (line, line[:, None]))

    def slopes(values: Reals) -> tuple[Floats, Floats]:
        right, down = (np.gradient(values, axis=axis)[used] for axis in (1, 0))
        return np.asarray(right, float), np.asarray(down, float)

    ahead = travel[:2] / max(float(np.linalg.norm(travel[:2])), 1e-12)
    (right, down), (bent_right, bent_down) = slopes(face), slopes(bent)
    light = (np.ones(len(x)), x, y, face[used])
    across = (ahead[0] * down - ahead[1] * right, *light)
    columns = (ahead[0] * right + ahead[1] * down, x * down - y * right, *across)
    shown = (ahead[0] * bent_right + ahead[1] * bent_down, x * bent_down - y * bent_right)
    known, wanted = np.stack(columns), np.stack(shown)
    known /= np.linalg.norm(known, axis=1, keepdims=True) + 1e-12  # its squares are well scaled
    norm = known * weight[used]
    fit = np.linalg.lstsq(norm @ known.T, norm @ wanted.T, rcond=None)[0]
    scale = np.linalg.norm(np.stack(columns[:2]), axis=1) + 1e-12
    return np.asarray(np.clip(np.diagonal(fit[:2]) / scale, 0.0, 1.0))


def _extrapolated(face: Singles, weight: Singles) -> Singles:
    """Continues a face (rows, columns) outwards, where it has no weight, by its nearest nodes."""
    near = distance_transform_edt(weight <= 0, return_distances=False, return_indices=True)
    return np.asarray(face[tuple(near)], np.float32)
