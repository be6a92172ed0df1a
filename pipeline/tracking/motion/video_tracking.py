"""A whole video: camera and templates from its first frame, then all frames in sequence."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.runtime import Picture, UserError
from pipeline.tracking.detect import (
    LatticeDetection,
    Relocaliser,
    classify_markings,
    orientation_text,
)
from pipeline.tracking.fit import PoseFitter, SideWalls, TemplateLearner
from pipeline.tracking.frames import BrokenOffError, Frame
from pipeline.tracking.geometry import SpecimenOutlines, arm_swing
from pipeline.tracking.motion import frame_timing as timing
from pipeline.tracking.motion import uncertainty
from pipeline.tracking.motion.tracker import TrackedFrame, Tracker
from pipeline.tracking.reference_frame import (
    CameraCalibration,
    RecordingSetup,
    ambiguity_text,
    calibrate_camera,
    check_outlines,
    recognise,
)
from sim.core import Floats, Ints, Reals, Singles

LOG = logging.getLogger(__name__)

_USUAL = RecordingSetup()
_End = BrokenOffError | KeyboardInterrupt


class Track(NamedTuple):
    """Motions of the units of a specimen.

    Attributes:
        time: (frames,) since the first of them, s.
        start: time of that one since the file's first frame, s.
        frame: (frames,) numbers in the file.
        displacement: (frames, units, 3) from the first frame on, mm and rad, NaN where missing.
        sigma: the standard uncertainties, likewise.
        quality: (frames, units) as in `tracker`.
        timing: (frames,) as in `timing`.
        calibration: of the camera.
        ended: what ended it before the video's end, if anything did.
    """

    time: Floats
    start: float
    frame: Ints
    displacement: Reals
    sigma: Reals
    quality: NDArray[np.int8]
    timing: Ints
    calibration: CameraCalibration
    ended: _End | None


def track_video(
    frames: Iterator[Frame],
    specimen: SpecimenOutlines,
    px_per_mm: float | None = None,
    tell: Callable[[], None] | None = None,
    setup: RecordingSetup = _USUAL,
) -> Track:
    """Tracks the specimen; what is kept of a frame are its poses, so memory hardly grows.

    Args:
        frames: in sequence; the first shows the specimen at rest.
        specimen: what they show.
        px_per_mm: roughly.
        tell: is called after each frame.
        setup: what is known of it.

    Raises:
        UserError: no frames, or the specimen is not in the first one.
    """
    first = next(frames, None)
    if first is None:
        raise UserError("the video has no frame in this window", key="window", remedy="widen it")
    ways = recognise(first.image, specimen, px_per_mm, setup)
    if doubt := ambiguity_text(ways):
        LOG.info(doubt)
    sighting = ways[0]
    calibration = calibrate_camera(first.image, specimen, sighting, setup)
    check_outlines(specimen, sighting, calibration)
    if (lies := orientation_text(calibration.camera)) != "upright":
        LOG.warning("warning: the specimen is %s; motions are in the design's own frame", lies)
    off_place = _off_place(first.image, specimen, sighting, calibration, setup.kind)
    tracker = tracker_of(first.image, specimen, calibration, setup.kind)
    rows, ended = _rows(_all(first, frames), tracker, tell)
    times, numbers, motion, sigmas, qualities = (
        np.array(values) for values in zip(*rows, strict=True)
    )
    del rows, tracker
    motion -= np.where(np.isfinite(motion[0]), motion[0], 0)
    motion[..., :2] += arm_swing(motion[..., 2], off_place)
    time = times - times[0]
    faults = timing.timing_faults(time, motion, sigmas)
    sigma = uncertainty.calibrate_sigma(motion, sigmas, specimen.centre, faults == timing.STEADY)
    sigma[~np.isfinite(motion)] = np.nan
    start = float(times[0])
    return Track(time, start, numbers, motion, sigma, qualities, faults, calibration, ended)


def _off_place(
    image: Picture,
    specimen: SpecimenOutlines,
    sighting: LatticeDetection,
    calibration: CameraCalibration,
    kind: str,
) -> Singles:
    """How far (units, 2) bare units rest off their design's places, mm.

    Templates turn about these places, so what the middle of such a unit swings about its place is
    missing from its shift. Of others it is not known: their outlines may be those of what was glued
    on, off the middle of the unit below.
    """
    camera = calibration.camera
    if kind == "auto":
        sighting = replace(sighting, camera=camera)
        kind = classify_markings(image, specimen, sighting, 1 / calibration.pixel)
    if kind != "bare":
        return np.zeros((specimen.count, 2), np.float32)
    seen = camera.beside(specimen.centre, calibration.residual)
    return np.nan_to_num(seen - specimen.centre).astype(np.float32)


class _Row(NamedTuple):
    """What is kept of a frame."""

    time: float
    frame: int
    pose: Singles
    sigma: Singles
    quality: NDArray[np.int8]


def _rows(
    frames: Iterator[Frame], tracker: Tracker, tell: Callable[[], None] | None
) -> tuple[list[_Row], _End | None]:
    """All frames tracked, or those before an end that comes too early."""
    rows: list[_Row] = []
    try:
        for frame in frames:
            found = tracker.step(frame.image)
            pose, sigma = found.fits.pose.astype(np.float32), _image_sigma(found)
            quality = found.quality.astype(np.int8)
            rows.append(_Row(frame.time, frame.index, pose, sigma, quality))
            if tell is not None:
                tell()
    except (BrokenOffError, KeyboardInterrupt) as error:
        if not rows:
            raise
        return rows, error
    return rows, None


def tracker_of(
    image: Picture, specimen: SpecimenOutlines, calibration: CameraCalibration, kind: str
) -> Tracker:
    """Templates as a first frame shows the units, at rest, and what follows them."""
    grid, blur, pixel = calibration.grid, calibration.blur, calibration.pixel
    learner = TemplateLearner(grid, blur, pixel, kind)
    rest, photometry = np.zeros((specimen.count, 3)), np.tile([1.0, 0, 0, 0], (specimen.count, 1))
    learner.add(image, calibration.camera, rest, photometry, np.ones(specimen.count))
    templates = learner.templates()
    depth, walls = calibration.depth, None
    if depth is not None:
        walls = SideWalls(specimen, depth, grid, templates, blur, pixel, kind)
    recovery = Relocaliser(specimen, calibration.camera, calibration.bright)
    return Tracker(specimen, PoseFitter(calibration.camera, templates), recovery, walls)


def _all(first: Frame, others: Iterator[Frame]) -> Iterator[Frame]:
    yield first
    yield from others


def _image_sigma(found: TrackedFrame) -> Singles:
    told = uncertainty.standard_errors(found.fits.scatter, found.fits.blocks)
    return np.asarray(told, np.float32)
