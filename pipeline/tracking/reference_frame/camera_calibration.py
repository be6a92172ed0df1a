"""Calibrates the camera and its blur by one frame that shows the specimen at rest."""

from typing import NamedTuple

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.detect import (
    LatticeDetection,
    same_orientation,
    specimen_orientation,
    with_distortion,
)
from pipeline.tracking.fit import (
    PoseFits,
    PoseFitter,
    TemplateGrid,
    Templates,
    block_places,
    outline_templates,
)
from pipeline.tracking.geometry import (
    Camera,
    Depth,
    SpecimenOutlines,
    estimate_depth,
    fit_camera,
    pixel_noise,
    sigma_point_cameras,
)
from pipeline.tracking.reference_frame.rest_places import RestPlaces, estimate_rest_places
from sim.core import Floats, Mask

BLURS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0, 2.4, 2.9)
"""Standard deviations that are tried, px."""
_ITERATIONS = 3
_DISTANCES = (300.0, 400.0, 550.0, 750.0, 1000.0, 1350.0, 1800.0, 2500.0)
"""Of a camera whose distance is not told, mm."""
_USUAL_BLUR = 1.0
_EQUIVALENT, _EQUIVALENT_PLACE = 1.1, 1.3
"""Dissimilarity of equivalent orientations, and of places of one, over that of the best."""
_LEAST_FOUND = 0.5
_BLUR_UNITS = 40
"""Units, about, that the blur is found on."""
_STRIDE = 4
"""Every so manyth row and column tells how bright a picture is."""
_EDGE_SIGMA = 0.02
"""Standard error of a unit's place by its outlines at best, px."""


class CameraCalibration(NamedTuple):
    """Holds the calibration by a reference frame."""

    camera: Camera  # refined on the outlines of the units
    grid: TemplateGrid  # nodes for templates
    blur: float  # standard deviation of the blur at edges, mm
    pixel: float  # size of a pixel at the middle of the specimen, mm
    rest: RestPlaces  # of the units
    residual: Floats  # (units, 2) where the units rest less where they should be, px
    depth: Depth | None  # of thick units whose walls are of the shade of their faces
    bright: bool  # whether the units are brighter than what is behind them
    outlines: PoseFits  # how these were fitted, from where the design has them
    sigma_points: list[Camera]  # others that may have seen them, each a standard deviation off


class RecordingSetup(NamedTuple):
    """Holds what is known of the set-up.

    Attributes:
        thickness: of the units, mm.
        distance: of the camera, mm.
        kind: what the units show: auto, dots, speckle or bare.
        turned: how far the specimen is turned in the picture, counter-clockwise, rad.
        mirrored: whether it is seen from behind.
        exposure: of a frame, s; without it, quick motions tell.
        readout: from the first row of a frame to its last, s.
        held: (units,) which are clamped.
        follows_supports: whether the camera's place is that of the clamped units.
    """

    thickness: float = 0.0
    distance: float | None = None
    kind: str = "auto"
    turned: float | None = None
    mirrored: bool | None = None
    exposure: float | None = None
    readout: float = 0.0
    held: Mask | None = None
    follows_supports: bool = False


def calibrate_camera(
    image: Picture, specimen: SpecimenOutlines, detection: LatticeDetection, setup: RecordingSetup
) -> CameraCalibration:
    """Refines the camera of a detection on the outlines of all units.

    The specimen is taken to be at rest where the design has it; what the units deviate from it
    is their own tolerance, and stays in the residual as far as outlines tell it. Where the set-up
    tells of thick units, their outlines are those of faces and walls together, if that is what the
    frame shows.
    """
    camera, gain = with_distortion(specimen, detection).camera, _image_contrast(image)
    pixel, blocks = _pixel_size(specimen, camera), block_places(camera)
    some = np.arange(0, specimen.count, -(-specimen.count // _BLUR_UNITS))

    def fit_blur(depth: Depth | None) -> tuple[float, float, TemplateGrid]:
        """Returns misfit, blur and grid; the misfit has one minimum and is followed until it."""
        reach = (3 * max(BLURS) + 2) * pixel
        if depth is not None:  # and as far as a back is seen from its face
            offset = depth.offset(specimen.centre, np.zeros((specimen.count, 3)))
            reach += 1.5 * float(np.linalg.norm(offset, axis=1).max())
        grid = TemplateGrid(specimen, 1 / pixel, reach, depth)
        few, least, best = grid.of(some), np.inf, BLURS[0]
        for blur in BLURS:
            drawn = outline_templates(few, blur * pixel, pixel, detection.bright)
            fitter = PoseFitter(camera, drawn, blocks)
            misfit = _misfit(fitter.fit(image, *fitter.start(gain)))
            if misfit > least:
                break
            least, best = misfit, blur
        return least, best, grid

    depth = None
    least, blur, grid = fit_blur(None)
    if setup.thickness > 0:
        middle = specimen.centre.mean(axis=0)
        for distance in _DISTANCES if setup.distance is None else (setup.distance,):
            thick = estimate_depth(camera, middle, setup.thickness, distance)
            with_walls = fit_blur(thick)
            if with_walls[0] < least:
                depth, (least, blur, grid) = thick, with_walls
    templates = outline_templates(grid, blur * pixel, pixel, detection.bright)
    for turn in range(_ITERATIONS + 1):
        fitter = PoseFitter(camera, templates)
        fits = fitter.fit(image, *fitter.start(gain))
        seen = camera.project(specimen.centre + fits.pose[:, :2])
        good = np.isfinite(fits.pose[:, 0])
        shown = specimen.centre[good], seen[good]
        if turn < _ITERATIONS:
            sigma = max(_EDGE_SIGMA, pixel_noise(*shown, camera))
            camera = fit_camera(*shown, camera.size, sigma, camera)
    rest = estimate_rest_places(fits)
    residual = camera.project(specimen.centre + rest.offset) - camera.project(specimen.centre)
    sigma_points, size = sigma_point_cameras(*shown, camera), (blur * pixel, pixel)
    return CameraCalibration(
        camera, grid, *size, rest, residual, depth, detection.bright, fits, sigma_points
    )


def best_orientations(
    image: Picture, specimen: SpecimenOutlines, detections: list[LatticeDetection]
) -> list[LatticeDetection]:
    """Keeps the detections whose outlines fit as well as any, one of each orientation.

    All are seen through one lens, which that way tells that matches most. Of places along the
    lattice, what the rim of the picture cuts tells one for each orientation.
    """
    if len(detections) == 1:
        return detections
    lens = with_distortion(specimen, max(detections, key=lambda one: one.score)).camera
    pixel = _pixel_size(specimen, detections[0].camera)
    grid = TemplateGrid(specimen, 1 / pixel, (3 * _USUAL_BLUR + 2) * pixel)
    templates = outline_templates(grid, _USUAL_BLUR * pixel, pixel, detections[0].bright)
    wrong = [_dissimilarity(image, specimen, templates, lens, one) for one in detections]
    kept = []
    for places in _by_orientation(detections):
        least = min(wrong[place] for place in places)
        if least <= _EQUIVALENT * min(wrong):
            near = [place for place in places if wrong[place] <= _EQUIVALENT_PLACE * least]
            best = min(near, key=lambda place: (detections[place].unexplained, wrong[place]))
            kept.append(detections[best])
    return kept


def _by_orientation(detections: list[LatticeDetection]) -> list[list[int]]:
    """Groups numbers of detections by orientation: turned and mirrored alike."""
    groups: list[list[int]] = []
    for number, one in enumerate(detections):
        turn, behind = specimen_orientation(one.camera)
        for group in groups:
            other = specimen_orientation(detections[group[0]].camera)
            if behind == other[1] and same_orientation(turn, other[0]):
                group.append(number)
                break
        else:
            groups.append([number])
    return groups


def _dissimilarity(
    image: Picture,
    specimen: SpecimenOutlines,
    templates: Templates,
    lens: Camera,
    detection: LatticeDetection,
) -> float:
    """Computes residuals of outlines times their rotations: outlines of others turn to fit.

    Rotations below the standard error of one unit's are noise, and count as that. Units without a
    blob of their own do not count: those at the rim differ from place to place.
    """
    camera = lens.resected(specimen.centre[detection.unit], detection.blob)
    fitter = PoseFitter(camera, templates)
    everywhere = fitter.fit(image, *fitter.start(_image_contrast(image)))
    fits = PoseFits(*(values[detection.unit] for values in everywhere))
    found = np.isfinite(fits.pose[:, 2])
    if found.mean() < _LEAST_FOUND:
        return np.inf
    turned = fits.pose[found, 2]
    turn = float(np.mean(np.abs(turned - np.median(turned))))
    return _misfit(fits) * max(turn, float(np.sqrt(np.median(fits.scatter[found, 2, 2]))))


def _image_contrast(image: Picture) -> float:
    low, high = np.percentile(image[::_STRIDE, ::_STRIDE], [5, 95])
    return float(high - low)


def _misfit(fits: PoseFits) -> float:
    """Returns the median residual over the gain; infinite for units that cannot be fitted."""
    ratio = fits.noise / np.abs(fits.photometry[:, 0])
    return float(np.median(np.where(np.isfinite(ratio), ratio, np.inf)))


def _pixel_size(specimen: SpecimenOutlines, camera: Camera) -> float:
    return 1 / float(np.median(camera.px_per_mm(specimen.centre)))
