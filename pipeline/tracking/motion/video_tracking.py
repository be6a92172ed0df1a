"""Tracks a video: camera and templates from its first frame, then all frames in sequence."""

from __future__ import annotations

import itertools
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
from pipeline.tracking.fit import PoseFitter, SideWalls, learn_templates
from pipeline.tracking.frames import BrokenOffError, Frame
from pipeline.tracking.geometry import SpecimenOutlines, arm_swing
from pipeline.tracking.motion import uncertainty
from pipeline.tracking.motion.frame_timing import STEADY, timing_faults
from pipeline.tracking.motion.tracker import Tracker
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
_Row = tuple[float, int, Singles, Singles, NDArray[np.int8]]
"""Time, number, poses, sigma and quality: what is kept of a frame."""


class Track(NamedTuple):
    """Holds the motions of the units of a specimen.

    Attributes:
        time: (frames,) since the first of them, s.
        start: time of that one since the file's first frame, s.
        frame: (frames,) numbers in the file.
        displacement: (frames, units, 3) from the first frame on, mm and rad, NaN where missing.
        sigma: the standard uncertainties, likewise.
        quality: (frames, units) as in `tracker`.
        timing: (frames,) as in `frame_timing`.
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
    calibration = calibrate_camera(first.image, specimen, ways[0], setup)
    check_outlines(specimen, ways[0], calibration)
    if (seen := orientation_text(calibration.camera)) != "upright":
        LOG.warning("warning: the specimen is %s; motions are in the design's own frame", seen)
    offset = _centre_offset(first.image, specimen, ways[0], calibration, setup.kind)
    tracker = _tracker(first.image, specimen, calibration, setup.kind)
    rows, ended = _track_frames(itertools.chain([first], frames), tracker, tell)
    times, numbers, motion, sigmas, qualities = (
        np.array(values) for values in zip(*rows, strict=True)
    )
    del rows, tracker
    motion -= np.where(np.isfinite(motion[0]), motion[0], 0)
    motion[..., :2] += arm_swing(motion[..., 2], offset)
    time = times - times[0]
    faults = timing_faults(time, motion, sigmas)
    sigma = uncertainty.calibrate_sigma(motion, sigmas, specimen.centre, faults == STEADY)
    sigma[~np.isfinite(motion)] = np.nan
    start = float(times[0])
    return Track(time, start, numbers, motion, sigma, qualities, faults, calibration, ended)


def _centre_offset(
    image: Picture,
    specimen: SpecimenOutlines,
    detection: LatticeDetection,
    calibration: CameraCalibration,
    kind: str,
) -> Singles:
    """Measures how far (units, 2) bare units rest off their design's places, mm.

    Templates turn about these places, so what the middle of such a unit swings about its place is
    missing from its shift. Of others it is not known: their outlines may be those of what was glued
    on, off the middle of the unit below.
    """
    camera = calibration.camera
    if kind == "auto":
        detection = replace(detection, camera=camera)
        kind = classify_markings(image, specimen, detection, 1 / calibration.pixel)
    if kind != "bare":
        return np.zeros((specimen.count, 2), np.float32)
    seen = camera.unproject(camera.project(specimen.centre) + calibration.residual)
    return np.nan_to_num(seen - specimen.centre).astype(np.float32)


def _track_frames(
    frames: Iterator[Frame], tracker: Tracker, tell: Callable[[], None] | None
) -> tuple[list[_Row], _End | None]:
    """Tracks all frames, or those before an end that comes too early."""
    rows: list[_Row] = []
    try:
        for frame in frames:
            fits, quality = tracker.step(frame.image)
            sigma = uncertainty.standard_errors(fits.scatter, fits.blocks).astype(np.float32)
            pose = fits.pose.astype(np.float32)
            rows.append((frame.time, frame.index, pose, sigma, quality.astype(np.int8)))
            if tell is not None:
                tell()
    except (BrokenOffError, KeyboardInterrupt) as error:
        if not rows:
            raise
        return rows, error
    return rows, None


def _tracker(
    image: Picture, specimen: SpecimenOutlines, calibration: CameraCalibration, kind: str
) -> Tracker:
    """Makes a tracker with templates as a first frame shows the units, at rest."""
    camera, grid = calibration.camera, calibration.grid
    blur, pixel, walls = calibration.blur, calibration.pixel, None
    templates = learn_templates(image, camera, grid, blur, pixel, kind)
    if calibration.depth is not None:
        walls = SideWalls(specimen, calibration.depth, grid, templates, blur, pixel, kind)
    relocaliser = Relocaliser(specimen, camera, calibration.bright)
    return Tracker(specimen, PoseFitter(camera, templates), relocaliser, walls)
