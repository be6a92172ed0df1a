"""Frames of long films, thinned without losing the drive's periods."""

import numpy as np
import pytest
import xarray as xr

from pipeline.comparison import find_axis, select_frames
from pipeline.comparison.measured_side import MOST_FRAMES
from tests.tables import refused

RATE, FREQUENCY, END = 500.0, 30.0, 0.2
WAY = np.array([0.6, 0.8])


def drive(time: np.ndarray) -> np.ndarray:
    """A vibration of six periods that grows over the first, then rest."""
    moving = (time > 0) & (time < END)
    grown = 4.5 * np.tanh(FREQUENCY * time) * np.sin(2 * np.pi * FREQUENCY * time)
    return np.where(moving, grown, 0.0)[:, None] * WAY


def test_a_short_film_is_compared_as_a_whole() -> None:
    np.testing.assert_array_equal(select_frames(np.full(MOST_FRAMES, np.nan), 0.1), range(600))


@pytest.mark.parametrize("start", [1.2, 5.03])
def test_a_long_high_speed_film_is_aligned_by_all_its_frames(start: float) -> None:
    samples = np.linspace(0.0, END, 201)
    response = xr.Dataset({"time": samples, "drive_displacement": (("time", "xy"), drive(samples))})
    time = np.arange(0.0, 7.0, 1 / RATE)
    noise = np.random.default_rng(0).normal(0.0, 0.007, (len(time), 2))
    axis = find_axis(time, drive(time - start) + noise, response, static=False)
    assert axis.lag is not None
    assert axis.lag.value == pytest.approx(start, abs=0.01 / RATE)
    assert not axis.lag.ambiguous
    kept = select_frames(axis.time, 1 / FREQUENCY)
    np.testing.assert_allclose(axis.select(kept).time, np.arange(0.0, END, 1 / RATE), atol=1 / RATE)


def test_many_frames_are_thinned_but_not_below_what_a_period_takes() -> None:
    time = np.concatenate([np.linspace(-1.0, -1e-3, 700), np.linspace(0.0, 2.0, 2001)])
    for period in (1.0, np.nan):
        kept = select_frames(time, period)
        assert 450 < len(kept) <= MOST_FRAMES
        assert time[kept[0]] == 0.0
        np.testing.assert_allclose(np.diff(time[kept]), 0.004)
    with refused("in a period of the drive, where 8 are wanted", "window"):
        select_frames(time, 0.03)
