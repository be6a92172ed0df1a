"""The camera and its blur, from one frame that shows the specimen at rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pipeline.tracking import camera as cameras
from pipeline.tracking.arrays import Floats, Ints, Picture
from pipeline.tracking.camera import Camera
from pipeline.tracking.find import Sighting, refined
from pipeline.tracking.fitting import Fitter
from pipeline.tracking.patch import Templates
from pipeline.tracking.specimen import Specimen
from pipeline.tracking.template import Grid, outlines, plane_of

BLURS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0, 2.4, 2.9)
"""Standard deviations that are tried, px."""
_ROUNDS = 3
_USUAL_BLUR = 1.0
_ALIKE = 1.1
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


def calibrate(image: Picture, specimen: Specimen, sighting: Sighting) -> Calibration:
    """Refines the camera of a sighting on the outlines of all units.

    The specimen is taken to be at rest where the design has it; what the units deviate from it
    is their own tolerance and stays in the residual.
    """
    sighting = refined(specimen, sighting)
    pixel, gain = _pixel(specimen, sighting.camera), _gain(image, sighting)
    grid = Grid(specimen, 1 / pixel, (3 * max(BLURS) + 2) * pixel)
    some, plane = grid.of(_few(specimen)), plane_of(sighting.camera)

    def misfit(blur: float) -> float:
        fitter = Fitter(sighting.camera, outlines(some, blur * pixel, pixel), plane)
        return _misfit(image, fitter, gain)

    blur = _lowest(misfit, BLURS) * pixel
    camera, residual = _refined(image, specimen, sighting.camera, outlines(grid, blur, pixel), gain)
    return Calibration(camera, grid, blur, pixel, residual)


def oriented(image: Picture, specimen: Specimen, sightings: list[Sighting]) -> Sighting:
    """The first of several ways to see a specimen that its outlines fit as well as any."""
    if len(sightings) == 1:
        return sightings[0]
    pixel = _pixel(specimen, sightings[0].camera)
    grid = Grid(specimen, 1 / pixel, (3 * _USUAL_BLUR + 2) * pixel).of(_few(specimen))
    templates = outlines(grid, _USUAL_BLUR * pixel, pixel)
    misfits = [
        _misfit(image, Fitter(one.camera, templates), _gain(image, one)) for one in sightings
    ]
    return sightings[int(np.argmax(np.array(misfits) <= _ALIKE * min(misfits)))]


def _few(specimen: Specimen) -> Ints:
    return np.arange(0, specimen.count, -(-specimen.count // _SOME))


def _gain(image: Picture, sighting: Sighting) -> float:
    low, high = np.percentile(image, [5, 95])
    return float(high - low) * (1 if sighting.bright else -1)


def _misfit(image: Picture, fitter: Fitter, gain: float) -> float:
    """Median of the residuals over the gain; infinite for units that cannot be fitted."""
    fits = fitter.fit(image, *fitter.start(gain))
    ratio = fits.noise / np.abs(fits.photometry[:, 0])
    return float(np.median(np.where(np.isfinite(ratio), ratio, np.inf)))


def _pixel(specimen: Specimen, camera: Camera) -> float:
    jacobian = camera.jacobian(specimen.centre)
    return 1 / float(np.median(np.sqrt(np.abs(np.linalg.det(jacobian)))))


def _refined(
    image: Picture, specimen: Specimen, camera: Camera, templates: Templates, gain: float
) -> tuple[Camera, Floats]:
    """The camera that sees the outlines where they are, and what is left (units, 2), px."""
    residual = np.full((specimen.count, 2), np.nan)
    for _ in range(_ROUNDS):
        fitter = Fitter(camera, templates)
        fits = fitter.fit(image, *fitter.start(gain))
        good = np.isfinite(fits.pose[:, 0])
        seen = camera.project(specimen.centre + fits.pose[:, :2])
        camera = cameras.fit(specimen.centre[good], seen[good], camera.size, _EDGE_SIGMA, camera)
        residual = seen - camera.project(specimen.centre)
    return camera, residual


def _lowest(misfit: Callable[[float], float], candidates: tuple[float, ...]) -> float:
    """The candidate with the least misfit, which has one minimum: stops when it rises."""
    best, least = candidates[0], np.inf
    for value in candidates:
        found = misfit(value)
        if found > least:
            break
        best, least = value, found
    return best
