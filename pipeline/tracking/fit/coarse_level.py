"""Fits units on a coarse level of a picture, from farther away than its own pixels allow.

Gauss-Newton comes from no farther than some widths of a blurred edge, which are pixels, whereas
what units move from frame to frame grows with the pixels from unit to unit. On a level whose pixels
are so many times as large it comes from as many times as far (a pyramid of two levels: Bergen et
al., ECCV 1992; Bouguet, Intel 2001).
"""

import cv2
import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.fit.frame_fit import PoseFitter
from pipeline.tracking.fit.patch_correlation import PoseFits
from pipeline.tracking.fit.template import TemplateGrid, learn_templates
from pipeline.tracking.geometry import Camera, SpecimenOutlines
from sim.core import Floats, Mask

_PITCH = 25.0
"""Pixels from unit to unit of a coarse level, at least: with fewer, units tell too little of their
turns. A quarter of a pitch, by which a unit may be off, is then some six to twelve of its pixels,
whatever the size of the picture."""
_REACH = 4.0
"""Templates reach so many standard deviations of the blur, and two pixels, beyond an outline."""


class CoarseLevel:
    """Fits poses of units in pictures of which blocks of pixels are averaged.

    Args:
        image: the frame at rest, of full size.
        specimen: its units.
        camera: what saw it.
        blur_and_kind: blur at edges, mm, and what the units show: auto, dots, speckle or bare.
        factor: pixels, each way, that are one of the coarse level.
    """

    def __init__(
        self,
        image: Picture,
        specimen: SpecimenOutlines,
        camera: Camera,
        blur_and_kind: tuple[float, str],
        factor: int,
    ) -> None:
        self._factor = factor
        self._seen = image, self._bin(image)
        coarse = camera.binned(factor)
        pixel = 1 / float(np.median(coarse.px_per_mm(specimen.centre)))
        fine, kind = blur_and_kind
        # the mean over f pixels has the variance (f^2 - 1) / 12 of theirs, in squares of a pixel
        blur = float(np.hypot(fine, pixel * np.sqrt((1 - factor**-2) / 12)))
        grid = TemplateGrid(specimen, 1 / pixel, _REACH * blur + 2 * pixel)
        templates = learn_templates(self._seen[1], coarse, grid, blur, pixel, kind)
        self._fitter = PoseFitter(coarse, templates)

    def fit(self, image: Picture, pose: Floats, photometry: Floats, chosen: Mask) -> PoseFits:
        """Fits the chosen units (units,), of poses and photometry as `PoseFitter.fit`."""
        return self._fitter.fit(self._binned(image), pose, photometry, chosen)

    def _binned(self, image: Picture) -> Picture:
        """Returns the coarse picture, which is made once however often a frame is searched."""
        if self._seen[0] is not image:
            self._seen = image, self._bin(image)
        return self._seen[1]

    def _bin(self, image: Picture) -> Picture:
        """Averages blocks of pixels; what is left over at the right and below is cut off."""
        rows, columns = (size // self._factor for size in image.shape)
        kept = image[: rows * self._factor, : columns * self._factor]
        out: Picture = np.empty((rows, columns), image.dtype)
        cv2.resize(kept, (columns, rows), dst=out, interpolation=cv2.INTER_AREA)
        return out


def coarse_factor(specimen: SpecimenOutlines, camera: Camera) -> int:
    """Returns how many pixels, each way, are one of the coarse level: one if there is to be none.

    It is f = floor(p / 25) of a pitch of p px, so that the level has 25 px to 50 px a pitch.
    """
    pitch = specimen.pitch * float(np.median(camera.px_per_mm(specimen.centre)))
    return max(1, int(pitch / _PITCH))
