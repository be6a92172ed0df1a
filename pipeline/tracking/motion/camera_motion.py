"""Takes out of motions what the camera adds: drifts, knocks, rows that are read later."""

import numpy as np

from pipeline.tracking.geometry import SpecimenOutlines, rigid_motion, rotation_matrix
from pipeline.tracking.reference_frame import CameraCalibration, RecordingSetup
from sim.core import Floats, Mask, Reals

_LEAST = 2
"""Clamped units that tell of the camera."""


def camera_motion(motion: Reals, sigma: Reals, centre: Floats, held: Mask) -> Floats | None:
    """Fits the rigid motion (frames, 3) of the clamped units, about the origin, mm and rad.

    Frames that show none of them have that of the frame before; nothing is returned if there are
    none in most frames.

    Args:
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) standard uncertainties by the image.
        centre: (units, 2) places at rest.
        held: (units,) which are clamped.
    """
    known = np.isfinite(motion[..., 0]) & held
    if (known.sum(axis=1) >= _LEAST).mean() < 0.5:
        return None
    out = np.zeros((len(motion), 3))
    for frame, units in enumerate(known):
        if frame and units.sum() < _LEAST:
            out[frame] = out[frame - 1]
        if units.sum() >= _LEAST:
            weight = 1 / np.square(sigma[frame, units, :2].astype(float)).sum(axis=1)
            now = centre[units] + motion[frame, units, :2]
            turn, shift = rigid_motion(centre[units], now, weight)
            out[frame] = *shift, turn
    return out


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
