"""The camera and its blur, from one frame that shows the specimen at rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.tracking import camera as cameras
from pipeline.tracking.arrays import Floats, Image
from pipeline.tracking.camera import Camera
from pipeline.tracking.find import Sighting
from pipeline.tracking.fitting import Fitter
from pipeline.tracking.specimen import Specimen
from pipeline.tracking.template import Grid, outlines, plane_of

BLURS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0, 2.4, 2.9)
"""Standard deviations that are tried, px."""
_ROUNDS = 3
_SOME = 40
"""Units, about, that the blur is found on."""
_EDGE_SIGMA = 0.02
"""How well the outlines of a unit place it, px: tells which are outliers, no more."""


class Calibration(NamedTuple):
    """What a reference frame tells.

    Attributes:
        camera: refined on the outlines of the units.
        grid: nodes for templates.
        blur: standard deviation of the blur at edges, mm.
        pixel: size of a pixel at the middle of the specimen, mm.
        residual: (units, 2) where the units are seen less where they should be, px.
    """

    camera: Camera
    grid: Grid
    blur: float
    pixel: float
    residual: Floats


def calibrate(image: Image, specimen: Specimen, sighting: Sighting) -> Calibration:
    """Refines the camera of a sighting on the outlines of all units.

    The specimen is taken to be at rest where the design has it; what the units deviate from it
    is their own tolerance and stays in the residual.
    """
    camera = sighting.camera
    jacobian = camera.jacobian(specimen.centre)
    pixel = 1 / float(np.median(np.sqrt(np.abs(np.linalg.det(jacobian)))))
    grid = Grid(specimen, 1 / pixel, (3 * max(BLURS) + 2) * pixel)
    low, high = np.percentile(image, [5, 95])
    gain = float(high - low) * (1 if sighting.bright else -1)
    plane = plane_of(camera)

    some = grid.of(np.arange(0, specimen.count, -(-specimen.count // _SOME)))

    def misfit(blur: float) -> float:
        fitter = Fitter(camera, outlines(some, blur * pixel, pixel), plane)
        fits = fitter.fit(image, *fitter.start(gain))
        return float(np.nanmedian(fits.noise / np.abs(fits.photometry[:, 0])))

    blur = _lowest(misfit, BLURS) * pixel
    templates = outlines(grid, blur, pixel)
    residual = np.full((specimen.count, 2), np.nan)
    for _ in range(_ROUNDS):
        fitter = Fitter(camera, templates)
        fits = fitter.fit(image, *fitter.start(gain))
        good = np.isfinite(fits.pose[:, 0])
        seen = camera.project(specimen.centre + fits.pose[:, :2])
        camera = cameras.fit(specimen.centre[good], seen[good], camera.size, _EDGE_SIGMA, camera)
        residual = seen - camera.project(specimen.centre)
    return Calibration(camera, grid, blur, pixel, residual)


def _lowest(misfit: object, candidates: tuple[float, ...]) -> float:
    """The candidate with the least misfit, which has one minimum: stops when it rises."""
    best, least = candidates[0], np.inf
    for value in candidates:
        found = misfit(value)  # type: ignore[operator]
        if found > least:
            break
        best, least = value, found
    return best
