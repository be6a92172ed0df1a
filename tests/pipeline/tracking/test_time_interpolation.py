"""Poses at the frames' times, of motions that are made up and seen as shutters show them."""

import numpy as np
import pytest

from pipeline.tracking.motion.prediction import latest_velocity
from pipeline.tracking.motion.time_interpolation import at_frame_times, middle_speed
from pipeline.tracking.motion.video_tracking import can_interpolate

RATE, PACE, NOISE = 30.0, 15.0, 0.002
UNITS = 200
SIGMA = np.full((30, UNITS, 3), NOISE * np.sqrt(2.0))
"""Of displacements: the reference has the noise of a frame."""
NEAR = (np.arange(UNITS)[:, None] + np.array([-2, -1, 1])) % UNITS


def swing(time: np.ndarray) -> np.ndarray:
    return 2.0 * np.sin(PACE * time)


@pytest.mark.parametrize(("readout", "exposure"), [(0.03, 0.0), (0.0, 0.025), (0.02, 0.01)])
def test_poses_are_those_at_frames_times_and_sigma_holds(readout: float, exposure: float) -> None:
    time = np.arange(30) / RATE
    late = readout * np.linspace(-0.5, 0.5, UNITS) + np.zeros((30, 1))
    bend = np.full((30, UNITS, 3), exposure**2 / 24)
    mean = np.sinc(PACE * exposure / 2 / np.pi)
    error = NOISE * np.random.default_rng(1).normal(size=(30, UNITS, 3))
    seen = mean * swing(time[:, None] + late)[..., None] + error
    given = seen - seen[0]
    pose, sigma, missed = at_frame_times(given, SIGMA, time, late, bend, NEAR)
    off = pose - pose[0] - (swing(time) - swing(time[:1]))[:, None, None]
    raw = given - (swing(time) - swing(time[:1]))[:, None, None]
    assert np.sqrt(np.mean(off[1:] ** 2)) < 0.35 * np.sqrt(np.mean(raw[1:] ** 2))
    honest = np.sqrt(np.mean((off[1:] / np.hypot(sigma, np.sqrt(missed))[1:]) ** 2))
    assert 0.7 < honest < 1.4


def test_a_unit_that_rests_in_few_frames_stays_where_it_is() -> None:
    time, late, bend = np.arange(8) / RATE, np.full((8, 1), 0.01), np.zeros((8, 1, 3))
    seen = np.where(np.arange(8)[:, None, None] < 4, 1.0, np.nan) * np.ones((8, 1, 3))
    pose, sigma, missed = at_frame_times(seen, np.ones_like(seen), time, late, bend, NEAR[:1])
    np.testing.assert_array_equal(pose, seen)
    assert ((sigma >= 1) & (sigma < 1.5)).all()
    assert np.isfinite(missed).all()


def test_velocities_are_those_of_the_polynomial_through_the_frames_seen() -> None:
    times = [0.0, 0.03, 0.07, 0.1]
    seen = [(one, np.full((2, 3), one**3)) for one in times]
    seen[0][1][1] = np.nan
    found = latest_velocity(seen)
    np.testing.assert_allclose(found[0], 3 * 0.1**2)
    assert (found[1] != found[0]).all()
    assert np.isnan(latest_velocity(seen[:1])).all()
    time = np.arange(9) / RATE
    motion = np.stack([swing(time), 0 * time, 0 * time], axis=-1)[:, None]
    assert middle_speed(motion, time, 4)[0] == pytest.approx(abs(2 * PACE * np.cos(2.0)), rel=1e-3)
    assert np.isnan(middle_speed(motion, time, 2)).all()


def test_frames_of_one_time_are_told(caplog: pytest.LogCaptureFixture) -> None:
    assert can_interpolate(np.array([0.0, 0.1, 0.3]))
    assert not caplog.text
    assert not can_interpolate(np.array([0.0, 0.1, 0.1, 0.5]))
    assert "several frames have one time" in caplog.text
