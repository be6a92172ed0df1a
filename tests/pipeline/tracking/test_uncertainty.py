"""Stated uncertainties on motions that are made up, with noise that is known."""

import numpy as np
import pytest

from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.tracking.motion import uncertainty
from pipeline.tracking.motion.camera_motion import camera_variance, remove_camera_motion
from pipeline.tracking.motion.motion_modes import count_at_rest
from pipeline.tracking.reference_frame import RecordingSetup
from sim.core import Floats

SIDE = 15
PLACES = [(10.0 * i, 10.0 * j) for j in range(SIDE) for i in range(SIDE)]
CENTRE = np.array(PLACES, np.float64)
SHOWN = SpecimenOutlines(
    np.arange(SIDE**2),
    CENTRE,
    np.zeros((SIDE**2, 4, 2)),
    np.empty((0, 2), int),
    np.zeros((1, 4), bool),
)
SIGN = 1.0 - 2.0 * (CENTRE.sum(axis=1) / 10 % 2)
HONEST = (0.8, 1.25)


def _made(motion: Floats, noise: Floats, told: float, seed: int) -> Floats:
    """Errors over sigma (frames - 1, units, 3), of motions (frames, units).

    The image tells the noise too small by a factor, but that of the first frame, the reference's.
    """
    random = np.random.default_rng(seed)
    by_unit = random.uniform(0.7, 1.4, len(CENTRE))
    error = noise[:, None, None] * by_unit[:, None] * random.normal(size=(*motion.shape, 3))
    image = np.broadcast_to((by_unit / told)[:, None], error.shape) * np.median(noise)
    error -= image[0] * random.normal(size=error[0].shape)
    error[0] = 0.0
    steady = np.ones(len(motion), bool)
    sigma = uncertainty.calibrate_sigma(motion[..., None] + error, image, CENTRE, steady)
    return np.asarray(error[1:] / sigma[1:])


def assert_spread(standard: Floats, low: float, high: float) -> None:
    spread = standard.std(axis=(0, 1))
    assert ((low < spread) & (spread < high)).all()


def _rough(frames: int, seed: int = 1) -> Floats:
    """Neighbours turn against each other, and each by its own amount; several such shapes."""
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 1.0, frames)
    amplitude = np.stack([40 * time, 6 * np.sin(5 * time), 1.5 * np.sin(9 * time)], axis=1)
    shape = np.stack([SIGN * random.uniform(0.2, 1.8, SIGN.size), *random.normal(size=(2, 225))])
    return np.asarray(amplitude @ shape)


@pytest.mark.parametrize("told", [1.0, 2.5, 5.0])
def test_rough_shapes_of_a_cloaked_structure_are_motion(told: float) -> None:
    assert_spread(_made(_rough(80), np.full(80, 0.05), told, 2), *HONEST)


def test_smooth_shapes_are_motion_however_small() -> None:
    smooth = np.sin(np.linspace(0, 6, 60))[:, None] * np.cos(CENTRE[:, 0] / 60) * 0.2
    assert_spread(_made(smooth, np.full(60, 0.05), 2.5, 3), *HONEST)
    random = np.random.default_rng(4)
    drift = np.cumsum(0.02 * random.normal(size=(40, len(CENTRE), 3)), axis=0)
    image = np.full_like(drift, 0.05)
    sigma = uncertainty.calibrate_sigma(drift, image, CENTRE, np.ones(40, bool))
    assert_spread(drift / sigma, 0.7, 1.5)


def test_a_long_recording_at_rest_in_its_beginning_is_judged_by_parts() -> None:
    noise = np.r_[np.full(450, 0.02), np.full(450, 0.1)]
    motion = np.concatenate([np.zeros((450, len(CENTRE))), _rough(450)])
    standard = _made(motion, noise, 2.0, 6)
    for part in (standard[:440], standard[460:]):
        assert HONEST[0] < part.std() < HONEST[1]


@pytest.mark.parametrize("frames", [8, 12, 15])
def test_few_frames_understate_nothing(frames: int) -> None:
    standard = _made(_rough(frames), np.full(frames, 0.05), 2.5, 7)
    assert 0.4 < standard.std() < HONEST[1]


def test_too_few_frames_get_a_usual_multiple_of_the_image_s_figure() -> None:
    image = np.full((5, len(CENTRE), 3), 0.01)
    sigma = uncertainty.calibrate_sigma(np.zeros_like(image), image, CENTRE, np.ones(5, bool))
    assert (sigma > 2 * image).all()
    assert (sigma < 3 * image).all()


@pytest.mark.parametrize(("drift", "first"), [(0.0, 12), (0.5, 3)])
def test_frames_that_drift_by_less_than_noise_are_not_at_rest(drift: float, first: int) -> None:
    """The units drift alike, from the third frame on, by so much of the noise from frame to frame.

    A codec's noise is alike from frame to frame, but not from unit to unit.
    """
    random = np.random.default_rng(11)
    moved = drift * np.maximum(np.arange(12) - 2, 0)[:, None, None] * np.array([1.0, 0.2])
    noise = random.normal(size=(12, len(CENTRE), 2))
    noise += np.cumsum(0.5 * random.normal(size=noise.shape), axis=0)
    near = uncertainty.nearest(CENTRE)
    assert first <= count_at_rest(moved + noise, near) <= max(first + 2, 5 if drift else 12)


def test_what_clamped_units_do_not_tell_of_the_camera_is_in_sigma() -> None:
    frames, held = 2000, CENTRE[:, 1] < 15
    noise = 0.01 * np.random.default_rng(12).normal(size=(frames, len(CENTRE), 3))
    noise[0, np.flatnonzero(held)[1:]] = np.nan
    motion, sigma = np.where(held[:, None], noise, 0.0), np.full_like(noise, 0.01)
    remove_camera_motion(
        motion, sigma, SHOWN, 1.0, RecordingSetup(held=held, follows_supports=True)
    )
    assert np.isnan(motion[0]).all()
    told = camera_variance(sigma, CENTRE, held)[1:, ~held].mean(axis=0)
    np.testing.assert_allclose(motion[1:, ~held].var(axis=0), told, rtol=0.15)


@pytest.mark.parametrize("turn", [0.0, 0.01])
def test_motion_of_the_clamped_units_is_told_where_they_are(
    turn: float, caplog: pytest.LogCaptureFixture
) -> None:
    """Two of them, far from the origin, about which noise looks as if it moved what is there."""
    held = np.arange(SIDE**2) >= SIDE**2 - 2
    motion = 0.02 * np.random.default_rng(13).normal(size=(50, SIDE**2, 3))
    motion[..., :2] += turn * CENTRE[:, ::-1] * [-1.0, 1.0]
    sigma = np.full_like(motion, 0.02)
    remove_camera_motion(motion, sigma, SHOWN, 1.0, RecordingSetup(held=held))
    assert bool(caplog.text) == (turn > 0)
    assert ("all clamped units move together, by up to 2.0" in caplog.text) == (turn > 0)


def test_a_part_in_which_nothing_is_seen_does_not_disturb_the_others() -> None:
    frames = 500
    motion = _rough(frames)[..., None] + np.zeros(3)
    error = 0.05 * np.random.default_rng(8).normal(size=motion.shape)
    motion, image = motion + error, np.full(motion.shape, 0.02)
    motion[250:], image[250:] = np.nan, np.nan
    sigma = uncertainty.calibrate_sigma(motion, image, CENTRE, np.ones(frames, bool))
    assert HONEST[0] < (error / sigma)[:250].std() < HONEST[1]
    assert np.isnan(sigma[250:]).all()


def test_scores_of_blocks_tell_the_error_of_what_was_fitted_to_them() -> None:
    """Residuals are smaller than errors by what the seven parameters of a fit take up."""
    blocks = 18
    turn = 2 * np.pi * np.arange(blocks)[:, None] / blocks * np.arange(1, 4)
    rows = np.concatenate([np.ones((blocks, 1)), np.cos(turn), np.sin(turn)], axis=1)
    inverse = np.linalg.inv(rows.T @ rows)
    errors = np.random.default_rng(0).normal(size=(1000, blocks))
    residual = errors - errors @ rows @ inverse @ rows.T
    scatter = np.einsum("db,bi,bj->dij", residual**2, rows @ inverse, rows @ inverse)
    told = uncertainty.standard_errors(scatter[:, :3, :3], np.full(1000, blocks))
    wanted = np.diagonal(inverse)[:3]
    np.testing.assert_allclose((told**2).mean(axis=0), wanted, rtol=0.05)
