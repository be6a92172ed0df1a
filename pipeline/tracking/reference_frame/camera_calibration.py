"""Calibrates the camera and its blur by one frame that shows the specimen at rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.detect import LatticeDetection, with_distortion
from pipeline.tracking.fit import (
    PoseFits,
    PoseFitter,
    TemplateGrid,
    Templates,
    outline_templates,
    pixel_plane,
)
from pipeline.tracking.geometry import Camera, Depth, SpecimenOutlines, estimate_depth
from pipeline.tracking.geometry import camera as cameras
from sim.core import Floats, Ints

BLURS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0, 2.4, 2.9)
"""Standard deviations that are tried, px."""
_ROUNDS = 3
_DISTANCES = (300.0, 400.0, 550.0, 750.0, 1000.0, 1350.0, 1800.0, 2500.0)
"""Of a camera whose distance is not told, mm."""
_USUAL_BLUR = 1.0
_ALIKE = 1.1
_FOUND = 0.5
_SOME = 40
"""Units, about, that the blur is found on."""
_EDGE_SIGMA = 0.02
"""How well the outlines of a unit place it, px: tells which are outliers, no more."""


class CameraCalibration(NamedTuple):
    """Holds what a reference frame tells.

    Attributes:
        camera: refined on the outlines of the units.
        grid: nodes for templates.
        blur: standard deviation of the blur at edges, mm.
        pixel: size of a pixel at the middle of the specimen, mm.
        residual: (units, 2) where the units are seen less where they should be, px.
        depth: of thick units whose walls are of the shade of their faces.
        bright: whether the units are brighter than what is behind them.
        outlines: how these were fitted, from where the design has them.
    """

    camera: Camera
    grid: TemplateGrid
    blur: float
    pixel: float
    residual: Floats
    depth: Depth | None
    bright: bool
    outlines: PoseFits


class RecordingSetup(NamedTuple):
    """Holds what is known of the set-up.

    Attributes:
        thickness: of the units, mm.
        distance: of the camera, mm.
        kind: what the units show: auto, dots, speckle or bare.
        turned: how far the specimen is turned in the picture, counter-clockwise, rad.
        mirrored: whether it is seen from behind.
    """

    thickness: float = 0.0
    distance: float | None = None
    kind: str = "auto"
    turned: float | None = None
    mirrored: bool | None = None


def calibrate_camera(
    image: Picture, specimen: SpecimenOutlines, sighting: LatticeDetection, setup: RecordingSetup
) -> CameraCalibration:
    """Refines the camera of a sighting on the outlines of all units.

    The specimen is taken to be at rest where the design has it; what the units deviate from it
    is their own tolerance and stays in the residual. Where the set-up tells of thick units, their
    outlines are those of faces and walls together, if that is what the frame shows.
    """
    sighting = with_distortion(specimen, sighting)
    pixel, gain = _pixel(specimen, sighting.camera), _gain(image, sighting)
    plane, some = pixel_plane(sighting.camera), _few(specimen)

    def fitted(depth: Depth | None) -> tuple[float, float, TemplateGrid]:
        reach = (3 * max(BLURS) + 2) * pixel + _furthest(specimen, depth)
        grid = TemplateGrid(specimen, 1 / pixel, reach, depth)
        few = grid.of(some)

        def misfit(blur: float) -> float:
            fitter = PoseFitter(sighting.camera, outline_templates(few, blur * pixel, pixel), plane)
            return _misfit(image, fitter, gain)

        return *_lowest(misfit, BLURS), grid

    depth = None
    least, blur, grid = fitted(None)
    if setup.thickness > 0:
        middle, told = specimen.centre.mean(axis=0), setup.distance
        for distance in _DISTANCES if told is None else (told,):
            thick = estimate_depth(sighting.camera, middle, setup.thickness, distance)
            with_walls = fitted(thick)
            if with_walls[0] < least:
                depth, (least, blur, grid) = thick, with_walls
    templates = outline_templates(grid, blur * pixel, pixel)
    camera, residual, fits = _refined(image, specimen, sighting.camera, templates, gain)
    return CameraCalibration(
        camera, grid, blur * pixel, pixel, residual, depth, sighting.bright, fits
    )


def _furthest(specimen: SpecimenOutlines, depth: Depth | None) -> float:
    """Bounds how far a back is seen from its face, mm."""
    if depth is None:
        return 0.0
    offset = depth.offset(specimen.centre, np.zeros((specimen.count, 3)))
    return 1.5 * float(np.linalg.norm(offset, axis=1).max())


def best_orientations(
    image: Picture, specimen: SpecimenOutlines, sightings: list[LatticeDetection]
) -> list[LatticeDetection]:
    """Keeps those of several ways to see a specimen that its outlines fit as well as any."""
    if len(sightings) == 1:
        return sightings
    pixel = _pixel(specimen, sightings[0].camera)
    grid = TemplateGrid(specimen, 1 / pixel, (3 * _USUAL_BLUR + 2) * pixel)
    templates = outline_templates(grid, _USUAL_BLUR * pixel, pixel)
    wrong = [_unlikeness(image, templates, one) for one in sightings]
    least = min(wrong)
    return [one for one, found in zip(sightings, wrong, strict=True) if found <= _ALIKE * least]


def _unlikeness(image: Picture, templates: Templates, sighting: LatticeDetection) -> float:
    """Residuals of the outlines times their rotations: outlines of others are turned to fit."""
    fits = _outlined(image, PoseFitter(sighting.camera, templates), _gain(image, sighting))
    found = np.isfinite(fits.pose[:, 2])
    if found.mean() < _FOUND:
        return np.inf
    turned = fits.pose[found, 2]
    return _relative(fits) * float(np.mean(np.abs(turned - np.median(turned))))


def _few(specimen: SpecimenOutlines) -> Ints:
    return np.arange(0, specimen.count, -(-specimen.count // _SOME))


def _gain(image: Picture, sighting: LatticeDetection) -> float:
    low, high = np.percentile(image, [5, 95])
    return float(high - low) * (1 if sighting.bright else -1)


def _misfit(image: Picture, fitter: PoseFitter, gain: float) -> float:
    """Returns the median residual over the gain; infinite for units that cannot be fitted."""
    return _relative(_outlined(image, fitter, gain))


def _relative(fits: PoseFits) -> float:
    ratio = fits.noise / np.abs(fits.photometry[:, 0])
    return float(np.median(np.where(np.isfinite(ratio), ratio, np.inf)))


def _outlined(image: Picture, fitter: PoseFitter, gain: float) -> PoseFits:
    """Fits of all units, from where the design has them."""
    return fitter.fit(image, *fitter.start(gain))


def _pixel(specimen: SpecimenOutlines, camera: Camera) -> float:
    jacobian = camera.jacobian(specimen.centre)
    return 1 / float(np.median(np.sqrt(np.abs(np.linalg.det(jacobian)))))


def _refined(
    image: Picture, specimen: SpecimenOutlines, camera: Camera, templates: Templates, gain: float
) -> tuple[Camera, Floats, PoseFits]:
    """Refines the camera on outlines; returns what is left (units, 2), px, and fits, too."""
    fits = _outlined(image, PoseFitter(camera, templates), gain)
    for _ in range(_ROUNDS):
        good = np.isfinite(fits.pose[:, 0])
        seen = camera.project(specimen.centre + fits.pose[:, :2])
        camera = cameras.fit_camera(
            specimen.centre[good], seen[good], camera.size, _EDGE_SIGMA, camera
        )
        fits = _outlined(image, PoseFitter(camera, templates), gain)
    seen = camera.project(specimen.centre + fits.pose[:, :2])
    return camera, seen - camera.project(specimen.centre), fits


def _lowest(misfit: Callable[[float], float], values: tuple[float, ...]) -> tuple[float, float]:
    """Finds the least misfit, which has one minimum, and its value: stops when it rises."""
    least, best = np.inf, values[0]
    for value in values:
        found = misfit(value)
        if found > least:
            break
        least, best = found, value
    return least, best
