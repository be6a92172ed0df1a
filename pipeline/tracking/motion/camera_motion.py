"""Removes the camera's motion: drifts, knocks; computes when rows are read."""

import logging

import numpy as np

from pipeline.runtime import UserError
from pipeline.tracking.geometry import SpecimenOutlines, arm_swing, rigid_motion, rotation_matrix
from pipeline.tracking.reference_frame import CameraCalibration, RecordingSetup
from sim.core import Floats, Mask, Reals

LOG = logging.getLogger(__name__)

_LEAST = 2
"""Clamped units that tell of the camera."""
_LEAST_MOTION = 0.2
"""Motion of all clamped units that is told of, px."""


def remove_camera_motion(
    motion: Reals, sigma: Reals, specimen: SpecimenOutlines, pixel: float, setup: RecordingSetup
) -> None:
    """Removes, in place, the rigid motion of all clamped units, or warns of it.

    Poses of frames that show fewer than two of them are lost (NaN), as the camera's is.

    Raises:
        UserError: the camera is to follow supports, and fewer than two are in view.
    """
    held = np.zeros(specimen.count, bool) if setup.held is None else setup.held
    common = camera_motion(motion, sigma, specimen.centre, held)
    if common is None:
        if setup.follows_supports:
            raise UserError(
                f"{np.count_nonzero(held)} clamped units are in the design, fewer than two in view",
                key="camera",
                value="follows supports",
                remedy="write `camera: fixed`, or film so that clamped units are in view",
            )
        return
    if setup.follows_supports:
        subtract_motion(motion, specimen.centre, common)
        return
    moved = common[:, None, :2] + arm_swing(common[:, None, 2], specimen.centre[held])
    ends = np.nanmax(np.linalg.norm(moved, axis=2)) / pixel
    if ends > _LEAST_MOTION:
        LOG.warning(
            "all clamped units move together, by up to %.2f px: the camera moved, or what"
            " holds them; `camera: follows supports` takes it out",
            ends,
        )


def camera_motion(motion: Reals, sigma: Reals, centre: Floats, held: Mask) -> Floats | None:
    """Fits the rigid motion (frames, 3) of the clamped units, about the origin, mm and rad.

    Frames that show fewer than two have none (NaN); nothing is returned if most frames do.

    Args:
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) standard uncertainties by the image.
        centre: (units, 2) places at rest.
        held: (units,) which are clamped.
    """
    known = np.isfinite(motion[..., 0]) & held
    if (known.sum(axis=1) >= _LEAST).mean() < 0.5:
        return None
    out = np.full((len(motion), 3), np.nan)
    for frame, units in enumerate(known):
        if units.sum() >= _LEAST:
            weight = 1 / np.square(sigma[frame, units, :2].astype(float)).sum(axis=1)
            now = centre[units] + motion[frame, units, :2]
            turn, shift = rigid_motion(centre[units], now, weight)
            out[frame] = *shift, turn
    return out


def camera_variance(sigma: Reals, centre: Floats, held: Mask) -> Reals:
    """Returns what the error of the clamped units' motion adds to variances (frames, units, 3).

    A mean with weights w has the variance sum w^2 sigma^2 / (sum w)^2, a turn about it by arms r
    that of sum (w r sigma)^2 / (sum w r^2)^2: far from the clamped units it shifts others.

    Args:
        sigma: (frames, units, 3) standard uncertainties, NaN where missing.
        centre: (units, 2) places at rest.
        held: (units,) which are clamped.
    """
    place = np.square(sigma[:, held, :2].astype(float))
    weight = np.nan_to_num(1 / place.sum(axis=2, keepdims=True))
    noise = np.nan_to_num(weight**2 * place)
    with np.errstate(divide="ignore", invalid="ignore"):  # frames that show none
        total = weight.sum(axis=1, keepdims=True)
        middle = np.sum(weight * centre[held], axis=1, keepdims=True) / total
        arm = (centre[held] - middle)[..., ::-1]
        shift = noise.sum(axis=1, keepdims=True) / total**2
        lever = np.sum(weight * arm**2, axis=(1, 2), keepdims=True)
        turn = np.sum(noise * arm**2, axis=(1, 2), keepdims=True) / lever**2
    far = shift + turn * (centre - middle)[..., ::-1] ** 2
    return np.concatenate([far, np.broadcast_to(turn, (*far.shape[:2], 1))], axis=2)


def subtract_motion(motion: Reals, centre: Floats, common: Floats) -> None:
    """Moves poses (frames, units, 3) back by rigid motions (frames, 3), in place."""
    for pose, (x, y, turn) in zip(motion, common, strict=True):
        there = centre + pose[:, :2] - [x, y]
        pose[:, :2] = there @ rotation_matrix(turn) - centre
        pose[:, 2] -= turn


def row_times(
    motion: Reals, specimen: SpecimenOutlines, calibration: CameraCalibration, setup: RecordingSetup
) -> Floats:
    """Returns when the rows of the units' middles are read, less the frames' times, s.

    Args:
        motion: (frames, units, 3) poses.
        specimen: the units.
        calibration: of the camera.
        setup: with the time from the first row to the last; a frame's is that of the middle one.

    Returns:
        (frames, units).
    """
    row = calibration.camera.project(specimen.centre + motion[..., :2].astype(float))[..., 1]
    return np.asarray(setup.readout * ((row + 0.5) / calibration.camera.size[1] - 0.5))
