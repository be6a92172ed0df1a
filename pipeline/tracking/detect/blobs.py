"""Detects a specimen in a frame: blobs, their ids by one-to-one matching, camera, markings."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.spatial.distance import cdist

from pipeline.runtime import Picture
from pipeline.tracking.detect.lattice_votes import Placement, locate_lattice
from pipeline.tracking.geometry import Camera, SpecimenOutlines, fit_camera, fit_homography
from sim.core import Floats, Image, Ints, Mask

_LEAST_TURN = 10  # deg
_EQUIVALENT, _SUFFICIENT = 0.95, 0.75
"""Scores, over the number of units: of ways to see it that are as good; after which to look no
further."""
_RELATIVE_SCALES = (0.95, 0.8, 0.67, 0.56, 0.47, 0.39, 0.32, 0.27, 0.22, 1.15)
"""Sizes of a specimen of unknown scale, over the largest at which all of it is in the picture."""
_AREA_RATIO = 3.0
"""A camera that makes units so many times larger or smaller than told sees something else."""
_BLOB_SIGMA = 0.2
_MARK_WIDTH = 0.25
"""Width of a median that a mark on a face does not survive, pitches."""
_ORIENTATION_DIFFERENCE = 0.35
"""Orientations that differ by so much are others, rad."""
_PLACE_DIFFERENCE = 0.5
"""Distance of places that are others, pitches."""
_MOST_SHIFTS = 24
"""Places along the lattice that are tried of one of which a part is seen."""
_SMALLEST = 0.25
"""Least area of a patch, over that of a unit: at the rim of a wide picture they are small."""
_MARGIN = 1.0
"""A unit nearer to the rim of the picture is not expected to be a patch of its own, radii."""
_SHADING_PIXELS = 32
"""Pixels a pitch that shades about a unit need at most."""
_MARK_CONTRAST = 0.25  # of the contrast: what differs more from a face's own shade is a mark
_MARKED_AREA = 0.02  # of a face
_MOST_DOTS = 4


@dataclass(frozen=True)
class LatticeDetection:
    """Holds units of a specimen, matched with blobs of a frame."""

    camera: Camera  # what sees the blobs where they are
    unit: Ints  # (matches,) units that have a blob of their own
    blob: Floats  # (matches, 2) its centroid, px
    blobs: int  # number of blobs of a unit's size
    bright: bool  # whether the units are brighter than what is behind them
    missing: int  # number of units without one that should be in the picture
    surplus: int = 0  # number of blobs without a unit that go on with the lattice
    unexplained: int = 0  # number of blobs that the rim cuts where it has no unit

    @property
    def score(self) -> int:
        """Returns matches less what should be there and is not, and the reverse."""
        return len(self.unit) - self.missing - self.surplus


def specimen_orientation(camera: Camera) -> tuple[float, bool]:
    """Returns the counter-clockwise turn in the image, rad, and whether it is seen from behind."""
    upward = camera.homography[:2, 1]
    turn = float(np.arctan2(-upward[0], -upward[1]))
    return turn, bool(np.linalg.det(camera.homography[:2, :2]) > 0)


def same_orientation(turn: float, other: float) -> bool:
    """Tests whether two angles, rad, are of one orientation."""
    return bool(abs(np.angle(np.exp(1j * (turn - other)))) < _ORIENTATION_DIFFERENCE)


def orientation_text(camera: Camera) -> str:
    """Describes the orientation: upright, turned, seen from behind."""
    turn, behind = specimen_orientation(camera)
    degrees = round(float(np.rad2deg(turn)))
    words = f"turned by {degrees} deg" if abs(degrees) > _LEAST_TURN else "upright"
    return f"{words} and mirrored, as from behind" if behind else words


def detection_summary(found: LatticeDetection, specimen: SpecimenOutlines) -> str:
    """Describes how many units were found, and where."""
    seen = f"{found.blobs} units found, {len(found.unit)} of {specimen.count} in their places"
    if not len(found.unit):
        return seen
    low, high = found.blob.min(axis=0), found.blob.max(axis=0)
    return f"{seen}, from ({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f}) px"


def detect_lattice(
    image: Picture, specimen: SpecimenOutlines, px_per_mm: float | None
) -> list[LatticeDetection]:
    """Finds the specimen, of either polarity, whichever way it is turned, mirrored or not.

    Args:
        image: the first frame.
        specimen: what to look for.
        px_per_mm: roughly; without it, the specimen is looked for at a fifth of the image and up.

    Returns:
        All ways of seeing it that match nearly as many units as the best: a lattice may look the
        same turned, and one of which a part is seen, a unit aside. Upright comes first, mirrored
        last. Their cameras are without distortion.
    """
    scales = [px_per_mm] if px_per_mm else _candidate_scales(image, specimen)
    found: list[LatticeDetection] = []
    for marked in (True, False):
        for scale in scales:
            shown = image if marked else _remove_marks(image, specimen.pitch * scale)
            for bright in (True, False):
                found = max(found, _match(shown, specimen, scale, bright), key=_best_score)
            if _best_score(found) > _SUFFICIENT * specimen.count:
                break
        if _best_score(found) > _SUFFICIENT * specimen.count:
            break
    least = _best_score(found) - (1 - _EQUIVALENT) * specimen.count
    return [one for one in found if one.score >= least]


def _candidate_scales(image: Picture, specimen: SpecimenOutlines) -> list[float]:
    """Lists candidate scales, px per mm; last those at which it fits only a quarter turned."""
    extent = np.ptp(specimen.centre, axis=0) + 2 * specimen.radius.mean()
    upright, turned = (
        min(image.shape[1] / wide, image.shape[0] / high) for wide, high in (extent, extent[::-1])
    )
    scales = [float(upright * share) for share in _RELATIVE_SCALES]
    return scales + [turned * share for share in _RELATIVE_SCALES if turned * share > max(scales)]


def _best_score(ways: list[LatticeDetection]) -> int:
    return max((one.score for one in ways), default=-(10**9))


def _remove_marks(image: Picture, pitch: float) -> Image:
    """Removes dots and speckle, which may stand out more than the faces themselves."""
    width = int(_MARK_WIDTH * pitch) | 1
    return np.asarray(cv2.medianBlur(np.clip(image, 0, 255).astype(np.uint8), width), np.uint8)


def _match(
    image: Picture, specimen: SpecimenOutlines, scale: float, bright: bool
) -> list[LatticeDetection]:
    """Returns matches, at least one, that differ in orientation or place; mirrored ones last."""
    patches, cut = _segment(image, specimen, scale, bright)
    size = (image.shape[1], image.shape[0])
    camera = Camera(np.eye(3), (np.array(size) - 1) / 2, np.zeros(2), size)
    nothing = LatticeDetection(
        camera, np.empty(0, int), np.empty((0, 2)), len(patches), bright, specimen.count
    )
    margin = _MARGIN * specimen.radius.mean() * scale

    def inside(place: Floats) -> Mask:
        return np.asarray(((place > margin) & (place < np.array(size) - 1 - margin)).all(axis=-1))

    found: list[tuple[bool, float, LatticeDetection]] = []
    for side in (1.0, -1.0):
        points = specimen.centre * [side, -1.0]
        others: list[Placement] = []
        for one in locate_lattice(
            points, specimen.joint, patches, scale, inside, most_seeds=_MOST_SHIFTS
        ):
            if any(_same_place(one, other, specimen.pitch * scale) for other in others):
                continue
            others.append(one)
            matrix = fit_homography(specimen.centre[one.unit], patches[one.patch])
            seen = replace(camera, homography=matrix)
            areas = np.abs(np.linalg.det(seen.jacobian(specimen.centre[one.unit]))) / scale**2
            if areas.min() > 1 / _AREA_RATIO and areas.max() < _AREA_RATIO:
                found.append(
                    (
                        side < 0,
                        abs(one.turn),
                        replace(
                            nothing,
                            camera=seen,
                            unit=one.unit,
                            blob=patches[one.patch],
                            missing=one.missing,
                            surplus=one.surplus,
                            unexplained=_count_unexplained(cut, one, specimen.pitch * scale),
                        ),
                    )
                )
    return [one for *_, one in sorted(found, key=lambda way: way[:2])] or [nothing]


def _same_place(one: Placement, other: Placement, pitch: float) -> bool:
    """Tests whether two placements have one orientation, and units in the same places."""
    if not same_orientation(one.turn, other.turn):
        return False
    apart = np.linalg.norm(one.place - other.place, axis=1)
    return bool(np.median(apart) < _PLACE_DIFFERENCE * pitch)


def _count_unexplained(cut: Floats, placed: Placement, pitch: float) -> int:
    """Counts blobs that the rim cuts (n, 2), px, and that are no unit's."""
    if not len(cut):
        return 0
    return int((cdist(cut, placed.place).min(axis=1) > _PLACE_DIFFERENCE * pitch).sum())


def with_distortion(specimen: SpecimenOutlines, detection: LatticeDetection) -> LatticeDetection:
    """Refits the camera of a detection with distortion."""
    seen = specimen.centre[detection.unit]
    camera = fit_camera(seen, detection.blob, detection.camera.size, _BLOB_SIGMA)
    return replace(detection, camera=camera)


def find_blobs(image: Picture, specimen: SpecimenOutlines, scale: float, bright: bool) -> Floats:
    """Returns centroids (n, 2) in px of patches of a unit's size that the rim does not cut."""
    return _segment(image, specimen, scale, bright)[0]


def _segment(
    image: Picture, specimen: SpecimenOutlines, scale: float, bright: bool
) -> tuple[Floats, Floats]:
    """Returns centroids, px, of patches of a unit's size: whole ones (n, 2), and cut ones."""
    pitch = specimen.pitch * scale
    window = int(pitch * 2) | 1
    signed = image.astype(np.float32) * (1 if bright else -1)
    grey = cv2.GaussianBlur(signed, (0, 0), max(0.02 * pitch, 0.5))
    few = max(1, int(pitch / _SHADING_PIXELS))  # what is local is so over pitches
    window = window // few | 1
    low, high = (
        change(grey[::few, ::few], np.ones((window, window), np.uint8))
        for change in (cv2.erode, cv2.dilate)
    )
    contrast = cv2.blur(high - low, (window, window))
    least = 0.3 * np.percentile(contrast, 90)
    middle = cv2.blur((low + high) / 2, (window, window))
    middle, contrast = (cv2.resize(each, grey.shape[::-1]) for each in (middle, contrast))
    mask = ((grey > middle) & (contrast > least)).astype(np.uint8)
    filled = _fill_holes(mask, 0.3 * float(np.median(specimen.area)) * scale**2)
    size = max(int(0.12 * pitch) | 1, 3)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    opened = cv2.morphologyEx(filled, cv2.MORPH_OPEN, kernel)
    _, _, stats, centroids = cv2.connectedComponentsWithStats(opened, connectivity=4)
    areas = stats[1:, cv2.CC_STAT_AREA] / scale**2
    good = (areas > _SMALLEST * specimen.area.min()) & (areas < 1.8 * specimen.area.max())
    left, top, wide, high = stats[1:, :4].T
    rows, columns = opened.shape
    whole = (left > 0) & (top > 0) & (left + wide < columns) & (top + high < rows)
    places = np.asarray(centroids[1:], np.float64)
    return places[good & whole], places[good & ~whole]


def _fill_holes(mask: Image, largest: float) -> Image:
    """Fills holes of the mask smaller than ``largest`` px: dots and speckle."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(1 - mask, connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] < largest
    small[0] = False
    return np.where(small[labels], np.uint8(1), mask)


def classify_markings(
    image: Picture, specimen: SpecimenOutlines, detection: LatticeDetection, px_per_mm: float
) -> str:
    """Classifies what most faces bear: dots, speckle, or nothing ("bare").

    The number of patches on them tells that differ from their own shade.
    """
    contrast = float(np.subtract(*np.percentile(image, [95, 5])))
    counts = [_count_marks(image, specimen, detection, unit, contrast) for unit in detection.unit]
    usual = float(np.median(counts))
    if usual < 1:
        return "bare"
    small = px_per_mm * specimen.pitch < 3 * _MOST_DOTS  # px: no dots can be told apart
    return "speckle" if usual > _MOST_DOTS or small else "dots"


def _count_marks(
    image: Picture,
    specimen: SpecimenOutlines,
    detection: LatticeDetection,
    unit: int,
    contrast: float,
) -> int:
    """Counts patches on a face, its rim left out."""
    shrunk = specimen.centre[unit] + 0.75 * specimen.polygon(unit)
    polygon = np.round(detection.camera.project(shrunk)).astype(np.int32)
    left, top, wide, high = cv2.boundingRect(polygon)
    area = image[max(top, 0) : top + high, max(left, 0) : left + wide].astype(float)
    if area.size == 0:
        return 0
    mask = np.zeros(area.shape, np.uint8)
    cv2.fillPoly(mask, [polygon - [max(left, 0), max(top, 0)]], 1)
    face = np.median(area[mask > 0]) if mask.any() else 0.0
    differs = ((np.abs(area - face) > _MARK_CONTRAST * contrast) & (mask > 0)).astype(np.uint8)
    if differs.sum() < _MARKED_AREA * mask.sum():
        return 0
    return int(cv2.connectedComponents(differs, connectivity=8)[0]) - 1
