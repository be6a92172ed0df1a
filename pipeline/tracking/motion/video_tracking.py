"""Tracks a video: camera and templates from its first frame, then all frames in sequence."""

import logging
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.runtime import Picture, UserError
from pipeline.tracking.detect import (
    LatticeDetection,
    Relocaliser,
    classify_markings,
    orientation_text,
)
from pipeline.tracking.fit import (
    CoarseLevel,
    ExposureBlur,
    PoseFitter,
    SideWalls,
    coarse_factor,
    learn_templates,
)
from pipeline.tracking.frames import Frame, TruncatedVideoError, check_durations
from pipeline.tracking.geometry import SpecimenOutlines, arm_swing, lens_variance
from pipeline.tracking.motion import uncertainty
from pipeline.tracking.motion.camera_motion import camera_variance, remove_camera_motion, row_times
from pipeline.tracking.motion.frame_timing import DUPLICATE, timing_faults, unrounded
from pipeline.tracking.motion.light_slopes import LightSlopes
from pipeline.tracking.motion.motion_modes import count_at_rest
from pipeline.tracking.motion.time_interpolation import at_frame_times, middle_speed
from pipeline.tracking.motion.tracker import Tracker
from pipeline.tracking.motion.unit_appearance import GOOD, HIDDEN, POOR_FIT, STRAYED
from pipeline.tracking.motion.unit_search import Shutter, UnitSearch
from pipeline.tracking.reference_frame import (
    CameraCalibration,
    RecordingSetup,
    RestPlaces,
    StillFrames,
    ambiguity_text,
    average_at_rest,
    calibrate_camera,
    check_outlines,
    recognise,
    start_warning,
    visible_outlines,
)
from sim.core import Floats, Ints, Mask, Reals, Singles

LOG = logging.getLogger(__name__)

_DEFAULT_SETUP = RecordingSetup()
_End = TruncatedVideoError | KeyboardInterrupt
_Row = tuple[float, int, Singles, Singles, NDArray[np.int8], float, float, Reals]
"""Time, number, poses, sigma, quality, part of the pixels that changed, inflation of the variance
by correlated residuals, shares of accelerations that show: what is kept of a frame."""
_SHARE_OF_DOF = [0, 0, 1]
"""Place in these shares of that of a shift, or of a rotation."""
_CODEC_INFLATION = 1.8
"""Inflation of the variance from which on a codec is at work."""
_LARGEST_SIGMA = 0.25
"""Standard deviation of a pose that is not known at its frame's time, px."""
_VAGUE = 1 / 6, 5.0
"""Standard deviation of a pose that is as good as lost, px, and over the usual: three of these are
half a pixel."""
_FINE_PITCH = 60.0
"""Pixels from unit to unit from which on such limits are parts of the pitch: what a motion leaves
open is a length, and a camera of twice as many pixels must not lose what one of half as many
keeps."""


class Track(NamedTuple):
    """Holds the motions of the units of a specimen."""

    time: Floats  # (frames,) since the first of them, s
    start: float  # time of that one since the file's first frame, s
    frame: Ints  # (frames,) numbers in the file
    displacement: Reals  # (frames, units, 3) from the first frame on, mm and rad, NaN where missing
    sigma: Reals  # the standard uncertainties, likewise
    quality: NDArray[np.int8]  # (frames, units) as in `tracker`
    timing: Ints  # (frames,) as in `frame_timing`
    calibration: CameraCalibration  # of the camera
    ended: _End | None  # what ended it before the video's end, if anything did
    resting: int  # number of first frames in which the specimen rests


def track_video(
    frames: Iterator[Frame],
    specimen: SpecimenOutlines,
    px_per_mm: float | None = None,
    tell: Callable[[], None] | None = None,
    setup: RecordingSetup = _DEFAULT_SETUP,
) -> Track:
    """Tracks the specimen; what is kept of a frame are its poses, so memory hardly grows.

    Args:
        frames: in sequence; the first shows the specimen at rest.
        specimen: what they show.
        px_per_mm: roughly.
        tell: is called after each frame.
        setup: what is known of it.

    Raises:
        UserError: no frames, the specimen is not in the first one, its motion is known in none, or
            the exposure or the readout is longer than from a frame to the next.
    """
    lasting = {"exposure": setup.exposure or 0.0, "readout": abs(setup.readout)}
    shown = average_at_rest(check_durations(frames, lasting))
    if not shown.averaged:
        raise UserError("the video has no frame in this window", key="window", remedy="widen it")
    ways = recognise(shown.image, specimen, px_per_mm, setup)
    if doubt := ambiguity_text(ways):
        LOG.info(doubt)
    calibration = calibrate_camera(shown.image, specimen, ways[0], setup)
    check_outlines(specimen, ways[0], calibration)
    if (seen := orientation_text(calibration.camera)) != "upright":
        LOG.warning("the specimen is %s; motions are in the design's own frame", seen)
    places = _measure_rest(shown.image, specimen, ways[0], calibration, setup.kind)
    tracker = _make_tracker(shown, specimen, calibration, setup)
    rows, ended = _track_frames(shown.frames, tracker, tell)
    times, numbers, motion, sigmas, qualities, changed, inflation, shares = (
        np.array(values) for values in zip(*rows, strict=True)
    )
    exposure = setup.exposure or _refine_exposure(tracker, motion, times)
    del rows, tracker
    if setup.exposure is None and exposure:
        LOG.info("exposure, by the blur of quick motions: %.3g ms", 1000 * exposure)
    time = times - times[0]
    near = uncertainty.nearest(specimen.centre)
    rest = count_at_rest(motion[: shown.averaged, :, :2].astype(float), near)
    added_variance = np.zeros_like(motion)
    limit = max(calibration.pixel, specimen.pitch / _FINE_PITCH)  # mm
    if (setup.readout or exposure) and can_interpolate(time):
        late = row_times(motion, specimen, calibration, setup)
        bend = exposure**2 / 24 * shares[..., _SHARE_OF_DOF]
        motion, sigmas, added_variance = at_frame_times(
            motion, sigmas, time, late, bend, near, rest
        )
        _discard_uncertain(motion, added_variance, qualities, limit)
    _subtract_rest(motion, rest, np.nan_to_num(places.offset).astype(np.float32))
    _add_variances(added_variance, motion, places, specimen, calibration, limit)
    remove_camera_motion(motion, sigmas, specimen, calibration.pixel, setup)
    qualities[np.isnan(motion[..., 0]) & (qualities == GOOD)] = HIDDEN  # as the supports are
    faults = timing_faults(time, motion, sigmas, changed)
    steady = faults != DUPLICATE
    later = inflation[1:][np.isfinite(inflation[1:])]
    coded = not len(later) or float(np.median(later)) > _CODEC_INFLATION
    own = shown.averaged / (shown.averaged + 1) / rest  # a frame's noise, over that of residuals
    even = unrounded(time)
    sigma = uncertainty.calibrate_sigma(motion, sigmas, specimen.centre, steady, even, own, coded)
    if setup.follows_supports and setup.held is not None:
        added_variance += camera_variance(sigma, specimen.centre, setup.held)
    sigma = np.where(np.isfinite(motion), np.hypot(sigma, np.sqrt(added_variance)), np.nan)
    vague = _are_vague(sigma, limit)
    motion[vague], sigma[vague], qualities[vague] = np.nan, np.nan, POOR_FIT
    moved = motion[..., :2].astype(float)
    if doubt := start_warning(moved, specimen.centre, calibration.residual, calibration.pixel):
        LOG.warning(doubt)
    start = float(times[0])
    return Track(time, start, numbers, motion, sigma, qualities, faults, calibration, ended, rest)


def _discard_uncertain(
    motion: Reals, added_variance: Reals, qualities: NDArray[np.int8], length: float
) -> None:
    """Discards, in place, poses (frames, units) that are not known at their frames' times.

    The length, mm, is that of a pixel, or of what counts as one.

    Raises:
        UserError: that are all.
    """
    off = np.sqrt(added_variance[..., :2].max(axis=-1)) / length
    usual = np.median(off, axis=1, keepdims=True)  # one unit alone has met with noise
    unsure = (off > _LARGEST_SIGMA) & (usual > _LARGEST_SIGMA / 5)
    motion[unsure], qualities[unsure] = np.nan, STRAYED
    if not np.isfinite(motion).any():
        what, remedy = "no unit has a pose in any frame", "correct exposure and readout"
        raise UserError(what, remedy=f"{remedy}, film at a higher rate, or rest in the first frame")
    if unsure.any():
        LOG.warning(
            "%.2g %% of the poses are lost, as more moves from frame to frame than"
            " tells where units were when other rows were read: film at a higher rate, or rest"
            " in the first frame",
            100 * unsure.mean(),
        )


def _add_variances(
    added_variance: Reals,
    motion: Reals,
    places: RestPlaces,
    specimen: SpecimenOutlines,
    calibration: CameraCalibration,
    length: float,
) -> None:
    """Adds variances of motions by those of rest places and camera; warns of too large ones."""
    camera, limit, far = calibration.camera, (_VAGUE[0] * length) ** 2, 0
    for frames, bent in lens_variance(camera, calibration.sigma_points, specimen.centre, motion):
        far += int((bent[..., :2].max(axis=-1) > limit).sum())
        added_variance[frames] += places.swing_variance(motion[frames, :, 2]) + bent
    if far:
        LOG.warning(
            "%.2g %% of the poses are lost, as they lie where the specimen at rest does not tell"
            " how the lens bends the picture: start where it fills more of it",
            100 * far / motion[..., 0].size,
        )


def _are_vague(sigma: Reals, length: float) -> Mask:
    """Marks poses (frames, units) far more uncertain than the others."""
    place = sigma[..., :2].max(axis=-1) / length
    known = np.isfinite(place)
    least, times = _VAGUE
    return known & (place > max(least, times * float(np.median(place[known]))))


def _refine_exposure(tracker: Tracker, motion: Reals, times: Floats) -> float:
    """Returns the exposure that blurs as was seen, by speeds that later frames tell as well."""
    found = []
    for blur in tracker.exposure.blurs:
        speed = middle_speed(motion.astype(float), times, int(np.searchsorted(times, blur.time)))
        ratio = blur.speed / speed
        known = np.isfinite(ratio)
        found.append(blur.exposure * float(np.median(ratio[known])) if known.any() else np.nan)
    return float(np.nanmedian(found)) if np.isfinite(found).any() else tracker.exposure.time


def _subtract_rest(motion: Reals, count: int, offset: Singles) -> None:
    """Counts motions (frames, units, 3), in place, from the mean of the first frames on.

    What the middles swing about the design's places, offset (units, 2), is added.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # some units are not seen at rest
        motion -= np.nan_to_num(np.nanmean(motion[:count], axis=0))
    motion[..., :2] += arm_swing(motion[..., 2], offset)


def _measure_rest(
    image: Picture,
    specimen: SpecimenOutlines,
    detection: LatticeDetection,
    calibration: CameraCalibration,
    kind: str,
) -> RestPlaces:
    """Measures where bare units rest; others are taken to where the design has them.

    Templates turn about these places, so what the middle of such a unit swings about its place is
    missing from its shift. Of others it is not known: their outlines may be those of what was glued
    on, off the middle of the unit below.
    """
    camera = calibration.camera
    if kind == "auto":
        detection = replace(detection, camera=camera)
        kind = classify_markings(image, specimen, detection, 1 / calibration.pixel)
    if kind != "bare":
        return RestPlaces.by_design(specimen.count)
    return calibration.rest


def _track_frames(
    frames: Iterator[Frame], tracker: Tracker, tell: Callable[[], None] | None
) -> tuple[list[_Row], _End | None]:
    """Tracks all frames, or those before an end that comes too early."""
    rows: list[_Row] = []
    before: Picture | None = None
    try:
        for frame in frames:
            fits, quality = tracker.step(frame.image, frame.time)
            sigma = uncertainty.standard_errors(fits.scatter, fits.blocks).astype(np.float32)
            pose = fits.pose.astype(np.float32)
            changed = 0.0 if before is None else _changed_share(before, frame.image)
            before, like = frame.image, uncertainty.variance_inflation(fits)
            kept = pose, sigma, quality.astype(np.int8), changed, like, tracker.bend_share
            rows.append((frame.time, frame.index, *kept))
            if tell is not None:
                tell()
    except (TruncatedVideoError, KeyboardInterrupt) as error:
        if not rows:
            raise
        return rows, error
    return rows, None


def can_interpolate(time: Floats) -> bool:
    """Tests whether times (frames,), s, ascend, as between frames; warns where they do not."""
    ascends = bool((np.diff(time) > 0.0).all())
    if not ascends:
        LOG.warning(
            "several frames have one time: rows count as read at that of their frame, and exposure"
            " as short; copy the video again"
        )
    return ascends


def _changed_share(before: Picture, image: Picture) -> float:
    """Computes the part of the pixels that differ by more than the level by which codecs err."""
    return cv2.countNonZero((cv2.absdiff(before, image) > 1).view(np.uint8)) / image.size


def _make_tracker(
    shown: StillFrames,
    specimen: SpecimenOutlines,
    calibration: CameraCalibration,
    setup: RecordingSetup,
) -> Tracker:
    """Makes a tracker with templates as the frames at rest show the units."""
    camera, grid, depth = calibration.camera, calibration.grid, calibration.depth
    look = calibration.blur, calibration.pixel, setup.kind
    left = shown.noise / float(np.sqrt(shown.averaged))
    templates = learn_templates(shown.image, camera, grid, *look, left)
    walls = None if depth is None else SideWalls(specimen, depth, grid, templates, *look)
    blur = ExposureBlur(templates, calibration.pixel) if walls is None else None
    if walls is not None and setup.exposure:
        LOG.warning(
            "side walls show: the blur of quick motions in the exposure is not allowed for; units"
            " that move by more than 0.3 px in it are found less well, or lost"
        )
    noise = shown.noise * float(np.sqrt(1 + 1 / shown.averaged))
    relocaliser = Relocaliser(specimen, camera, calibration.bright)
    shutter = Shutter(setup.exposure, setup.readout, noise)
    fitter, slopes = PoseFitter(camera, templates), LightSlopes(specimen.count, shown.averaged)
    seen = visible_outlines(calibration.outlines)
    factor, coarse = coarse_factor(specimen, camera), None
    if factor > 1:
        told = calibration.blur, setup.kind
        coarse = CoarseLevel(shown.image, specimen, camera, told, factor)
    search = UnitSearch(specimen, fitter, relocaliser, walls, shutter, blur, coarse)
    return Tracker(search, slopes, seen)
