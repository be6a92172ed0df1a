"""Recognises the specimen in a first frame, or rejects the frame and says what it shows."""

import logging

import numpy as np

from pipeline.runtime import Picture, UserError
from pipeline.tracking.detect import (
    LatticeDetection,
    detect_lattice,
    detection_summary,
    orientation_text,
    specimen_orientation,
)
from pipeline.tracking.fit import PoseFits
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.tracking.reference_frame.camera_calibration import (
    CameraCalibration,
    RecordingSetup,
    best_orientations,
)
from sim.core import Mask

LOG = logging.getLogger(__name__)

_LEAST_RANGE = 8.0
_SCALE_ERROR = 0.15
_FOUND_IN_VIEW = 0.6
_SURPLUS = 0.06
"""Patches that go on with the lattice where the design has no unit, at most, over the units."""
_FOUND_OF_ALL = 0.3
"""Least parts that a first look must find: of the units that are in the picture, and of all."""
_LARGEST_OFFSET = 0.15
_LARGEST_TURN = np.deg2rad(8.0)
_RESIDUAL_RATIO = 4.0
"""An outline is another one if it lies so many pitches from where the design has it, is turned so
far, or fits so many times worse than is usual."""
_MARKS_RESIDUAL = 0.3
"""Residuals over contrast that marks on a face may cause."""
_FOREIGN_SHARE = 0.1
"""Most part of the units whose outlines may be others."""
_QUARTER = np.pi / 4
_FEWEST_PIXELS, _NEEDED, _GOOD_PIXELS = 12.0, 20.0, 40.0
"""Pixels from unit to unit below which outlines tell no camera; with which they tell units from
others for sure; and with which they are told well."""
_FEWEST_UNITS = 6
"""Units, below which their places do not tell how large a pixel is."""
_FAINT_CONTRAST = 0.12
"""Contrast of a unit, over the usual one, below which it is hidden."""


def recognise(
    image: Picture, specimen: SpecimenOutlines, px_per_mm: float | None, setup: RecordingSetup
) -> list[LatticeDetection]:
    """Finds all ways to see the specimen in a first frame that its outlines do not tell apart.

    Raises:
        UserError: it is not there, or not at this scale, or not as the set-up says.
    """
    if float(np.ptp(image)) < _LEAST_RANGE:
        raise UserError(
            "the first frame is black or without contrast",
            key="window.start",
            remedy="start (of track init: --start) where the specimen is lit",
        )
    found = detect_lattice(image, specimen, px_per_mm)
    if px_per_mm is not None and not _is_recognised(found[0], specimen):
        anywhere = detect_lattice(image, specimen, None)
        if _is_recognised(anywhere[0], specimen):
            _check_scale(anywhere[0], specimen, px_per_mm)
            found = anywhere
    if not _is_recognised(found[0], specimen):
        raise _rejection(specimen, found[0], detection_summary(found[0], specimen))
    if _pitch(specimen, found[0]) < _FEWEST_PIXELS:
        raise _too_coarse(specimen, found[0])
    return _match_setup(best_orientations(image, specimen, found), setup)


def _is_recognised(found: LatticeDetection, specimen: SpecimenOutlines) -> bool:
    """Tests whether most of the units in the picture were found, some of all, and few others."""
    units = len(found.unit)
    if found.surplus > _SURPLUS * units:
        return False
    return units >= max(_FOUND_IN_VIEW * (units + found.missing), _FOUND_OF_ALL * specimen.count)


def ambiguity_text(ways: list[LatticeDetection]) -> str:
    """Describes several ways to see a specimen; nothing if there is one."""
    if len(ways) == 1:
        return ""
    others = "; ".join(orientation_text(way.camera) for way in ways[1:])
    return (
        f"the specimen is taken to be {orientation_text(ways[0].camera)}; its lattice would look"
        f" the same {others}: say `turned` and `mirrored` in the recording if it is"
    )


def check_outlines(
    specimen: SpecimenOutlines, detection: LatticeDetection, calibration: CameraCalibration
) -> None:
    """Refuses a first frame whose outlines are others than the design's.

    Raises:
        UserError: telling how many units were found, and where.
    """
    there = units_in_frame(specimen, calibration)
    foreign = there & ~agreeing_outlines(specimen, calibration.outlines)
    if foreign.sum() > _FOREIGN_SHARE * there.sum():
        seen = f"{detection_summary(detection, specimen)}; {_name_units(specimen, foreign)}"
        raise _rejection(specimen, detection, seen)
    if not there.all():
        LOG.warning(
            "%d units reach out of the first frame; where a whole row does, the lattice"
            " may lie a unit aside from where it is taken to be",
            np.count_nonzero(~there),
        )
    if foreign.any():
        LOG.warning("%s in the first frame", _name_units(specimen, foreign))


def agreeing_outlines(specimen: SpecimenOutlines, outlines: PoseFits) -> Mask:
    """Marks units (units,) with the outlines of the design, where it has them."""
    ratio = outlines.noise / np.abs(outlines.photometry[:, 0])
    near = np.linalg.norm(outlines.pose[:, :2], axis=1) < _LARGEST_OFFSET * specimen.pitch
    upright = np.abs(outlines.pose[:, 2]) < _LARGEST_TURN
    usual = max(_RESIDUAL_RATIO * float(np.nanmedian(ratio)), _MARKS_RESIDUAL)
    return np.asarray(near & upright & (ratio < usual))


def visible_outlines(outlines: PoseFits) -> Mask:
    """Marks units (units,) that stand out from what is behind them as most do, or are cut off.

    One under a hand or a glare looks like that: what is learned of it follows the hand.
    """
    gain = outlines.photometry[:, 0]
    return np.asarray(~(gain / np.nanmedian(gain) < _FAINT_CONTRAST))


def units_in_frame(specimen: SpecimenOutlines, calibration: CameraCalibration) -> Mask:
    """Marks units (units,) that lie whole in the picture."""
    middle = calibration.camera.project(specimen.centre)
    reach = specimen.radius[:, None] / calibration.pixel
    last = np.array(calibration.camera.size) - 1
    return np.asarray(((middle > reach) & (middle < last - reach)).all(axis=1))


def units_out_of_frame(specimen: SpecimenOutlines, calibration: CameraCalibration) -> Mask:
    """Marks units (units,) of which the picture shows nothing."""
    middle = calibration.camera.project(specimen.centre)
    reach = specimen.radius[:, None] / calibration.pixel
    last = np.array(calibration.camera.size) - 1
    return np.asarray(((middle < -reach) | (middle > last + reach)).any(axis=1))


def _name_units(specimen: SpecimenOutlines, foreign: Mask) -> str:
    ids = ", ".join(map(str, specimen.ids[foreign][:8])) + (", ..." if foreign.sum() > 8 else "")
    are = "1 unit is" if foreign.sum() == 1 else f"{foreign.sum()} units are"
    return f"{are} hidden or not as the design has them ({ids})"


def _pitch(specimen: SpecimenOutlines, found: LatticeDetection) -> float:
    """Measures the distance of joined units in a frame, px; infinite where too few were found."""
    if len(found.unit) < max(_FEWEST_UNITS, _FOUND_OF_ALL * specimen.count):
        return np.inf
    return specimen.pitch * float(np.median(found.camera.px_per_mm(specimen.centre)))


def _too_coarse(specimen: SpecimenOutlines, found: LatticeDetection) -> UserError:
    return UserError(
        f"{_pitch(specimen, found):.0f} px from unit to unit are too few to tell units and their"
        f" motions: {_NEEDED:.0f} px are needed, {_GOOD_PIXELS:.0f} px are good",
        key="video",
        remedy="film from closer, with a longer lens, or at a higher resolution",
    )


def _rejection(specimen: SpecimenOutlines, found: LatticeDetection, seen: str) -> UserError:
    """Explains a first frame whose units are not the design's: few pixels, or another design."""
    if _pitch(specimen, found) < _NEEDED:
        return _too_coarse(specimen, found)
    return UserError(
        f"the first frame does not show this design: {seen}",
        key="design",
        remedy="give the design of the specimen, its structure and its pixel_size, and start the"
        " window (of track init: --start) where all of it is seen, at rest",
    )


def _match_setup(found: list[LatticeDetection], setup: RecordingSetup) -> list[LatticeDetection]:
    """Selects the detections with the orientation that the set-up states.

    Raises:
        UserError: none is.
    """
    kept = []
    for one in found:
        turn, behind = specimen_orientation(one.camera)
        off = 0.0 if setup.turned is None else np.angle(np.exp(1j * (turn - setup.turned)))
        if abs(off) < _QUARTER and setup.mirrored in (None, behind):
            kept.append(one)
    if not kept:
        seen = "; ".join(orientation_text(one.camera) for one in found)
        raise UserError(
            f"the specimen is seen otherwise: {seen}",
            key="turned" if setup.turned is not None else "mirrored",
            remedy="correct it, or leave it out",
        )
    return kept


def _check_scale(found: LatticeDetection, specimen: SpecimenOutlines, px_per_mm: float) -> None:
    """Refuses a pixel size far from that which shows the specimen."""
    size = float(np.median(found.camera.px_per_mm(specimen.centre)))
    if abs(np.log(size / px_per_mm)) > _SCALE_ERROR:
        raise UserError(
            f"the specimen is there, but pixels measure about {1 / size:.3g} mm on it",
            key="pixel_size",
            value=f"{1 / px_per_mm:.3g} mm",
            remedy="correct it, or leave it out",
        )
