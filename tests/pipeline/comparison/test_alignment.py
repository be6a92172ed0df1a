"""Lags, loads and similarities that are known, found again to the precision that is stated."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.comparison import pixel_size, register
from pipeline.comparison.alignment import (
    LOADING,
    UNLOADING,
    SampledMotion,
    drive_turn,
    find_branches,
    find_lag,
    find_load_time,
)
from pipeline.comparison.nominal_side import find_axis
from pipeline.runtime import UserError
from tests.pipeline.samples import sample
from tests.tables import refused, some

RATE = 60.0
TIMES = np.linspace(0.0, 2.0, 401)


def sine(time: np.ndarray) -> np.ndarray:
    """Two cycles a second, from rest at time zero, along a line."""
    wave = np.where(time > 0, 4.5 * np.sin(4 * np.pi * time), 0.0)
    return wave[:, None] * np.array([0.8, 0.6])


NOMINAL = SampledMotion(TIMES, sine(TIMES))


def filmed(
    lag: float, frames: int = 90, noise: float = 0.0, seed: int = 0, alike: float = 0.0
) -> SampledMotion:
    """Films the drive with noise, whose neighbours are correlated by `alike`."""
    from scipy.signal import lfilter

    time = np.arange(frames) / RATE
    drawn = np.random.default_rng(seed).normal(0.0, noise, (frames, 2))
    drawn = lfilter([np.sqrt(1 - alike**2)], [1.0, -alike], drawn, axis=0)
    return SampledMotion(time, sine(time - lag) + drawn)


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.1, 0.4))
def test_a_known_lag_is_found_to_a_hundredth_of_a_frame(lag: float) -> None:
    found = find_lag(filmed(lag), NOMINAL)
    assert abs(found.value - lag) < 0.01 / RATE
    assert found.gain == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("alike", some([0.8, 0.0], 1))
def test_the_stated_uncertainty_of_the_lag_is_that_of_the_result(alike: float) -> None:
    found = [
        find_lag(filmed(0.21, noise=0.05, seed=seed, alike=alike), NOMINAL) for seed in range(40)
    ]
    off = np.array([(each.value - 0.21) / each.sigma for each in found])
    assert 0.65 < np.std(off) < 1.35
    assert found[0].sigma < 0.05 / RATE


def test_gaps_and_a_gain_are_not_taken_for_a_lag() -> None:
    course = filmed(0.1)
    course.value[20:40] = np.nan
    assert find_lag(course, NOMINAL).value == pytest.approx(0.1, abs=0.01 / RATE)
    course = filmed(0.1)
    found = find_lag(SampledMotion(course.time, 1.3 * course.value), NOMINAL)
    assert found.gain == pytest.approx(1.3, abs=2e-3)
    assert found.value == pytest.approx(0.1, abs=0.01 / RATE)


def test_a_steady_vibration_is_said_to_be_ambiguous() -> None:
    time = np.arange(60) / RATE
    steady = SampledMotion(time, sine(time + 0.5 - 0.02))
    found = find_lag(steady, NOMINAL)
    assert found.ambiguous
    assert np.angle(np.exp(4j * np.pi * (found.value - 0.02))) == pytest.approx(0.0, abs=0.01)
    assert not find_lag(filmed(0.2), NOMINAL).ambiguous


@pytest.mark.parametrize(("ramp", "periods"), [(0, 30), (2, 10), (3, 9)])
def test_a_period_off_is_not_as_good_where_noise_is_small(ramp: int, periods: int) -> None:
    def course(time: np.ndarray) -> np.ndarray:
        grown = np.tanh(2 * time / ramp) if ramp else 1.0
        return np.where(time > 0, 4.5 * grown * np.sin(4 * np.pi * time), 0.0)[:, None]

    end = periods / 2
    nominal = SampledMotion(*(each(np.linspace(0, end, 40 * periods)) for each in (abs, course)))
    time = np.arange(0.0, end, 1 / RATE)
    noise = np.random.default_rng(0).normal(0.0, 0.007, (len(time), 1))
    found = find_lag(SampledMotion(time, course(time - 0.7) + noise), nominal)
    assert found.value == pytest.approx(0.7, abs=0.01 / RATE)
    assert not found.ambiguous


def test_noise_does_not_hide_that_a_steady_vibration_is_ambiguous() -> None:
    time = np.arange(60) / RATE
    noise = np.random.default_rng(0).normal(0.0, 0.05, (60, 2))
    assert find_lag(SampledMotion(time, sine(time + 0.48) + noise), NOMINAL).ambiguous


def test_other_frequencies_and_too_few_frames_are_refused() -> None:
    time = np.arange(90) / RATE
    other = SampledMotion(time, sine(2.7 * time))
    with pytest.raises(UserError, match=r"cannot be aligned[\s\S]*correlation"):
        find_lag(other, NOMINAL)
    with pytest.raises(UserError, match="cannot be aligned"):
        find_lag(SampledMotion(time, np.zeros((90, 2))), NOMINAL)
    with pytest.raises(UserError, match="too few frames"):
        find_lag(filmed(0.0, frames=7), NOMINAL)
    with pytest.raises(UserError, match="too few frames"):
        find_load_time(np.full(20, np.nan), SampledMotion(TIMES, TIMES[:, None]))
    with refused("have the time of the one before", "frame_rate"):
        find_lag(SampledMotion(np.floor(RATE * time / 5) / RATE, sine(time)), NOMINAL)


def test_equal_displacement_is_equal_load_on_both_branches() -> None:
    path = SampledMotion(TIMES, 15 * (1 + np.tanh(3 * (TIMES - 1)))[:, None])
    there = np.concatenate([np.linspace(path.value[0, 0], 20, 50), np.linspace(20, 5, 30)])
    found = find_load_time(there, path)
    np.testing.assert_allclose(path.at(found)[:, 0], there, atol=1e-4)
    np.testing.assert_array_equal(find_branches(there)[[5, 40]], LOADING)
    np.testing.assert_array_equal(find_branches(there)[[60, 75]], UNLOADING)


def test_loads_beyond_have_no_time_others_are_refused() -> None:
    ramp = SampledMotion(TIMES, 10 * TIMES[:, None])
    found = find_load_time(np.linspace(-0.01, 25.0, 26), ramp)
    assert found[0] == 0.0
    assert np.isfinite(found[:20]).all()
    assert np.isnan(found[22:]).all()
    with pytest.raises(UserError, match="cannot be aligned"):
        find_load_time(np.linspace(0.0, -15.0, 30), ramp)
    with pytest.raises(UserError, match="to and fro"):
        find_load_time(np.linspace(0.0, 1.0, 30), SampledMotion(TIMES, np.sin(TIMES * 4)[:, None]))


def test_branches_follow_the_direction_of_a_load() -> None:
    held = np.concatenate([np.zeros(20), np.linspace(0, 9, 40), np.full(20, 9.0)])
    assert (find_branches(held) == LOADING).all()
    up, rest = np.linspace(0.0, 1.0, 100), np.ones(40)
    found = find_branches(np.concatenate([up, rest, up[::-1], up]))
    assert (found[10:130] == LOADING).all()
    assert (found[150:230] == UNLOADING).all()
    assert (found[250:330] == LOADING).all()
    line = np.linspace(0, 5, 9)[:, None]
    assert drive_turn(line * [np.cos(0.1), np.sin(0.1)], line * [1.0, 0.0]) == pytest.approx(0.1)


GRID = 15.0 * np.stack(np.meshgrid(np.arange(7.0), np.arange(7.0)), axis=-1).reshape(-1, 2)


def moved(rotation: float, scale: float, shift: tuple[float, float]) -> np.ndarray:
    cos, sin = np.cos(rotation), np.sin(rotation)
    middle = GRID.mean(axis=0)
    return scale * (GRID - middle) @ np.array([[cos, sin], [-sin, cos]]) + middle + shift


@settings(max_examples=30, deadline=None)
@given(
    rotation=st.floats(-3.0, 3.0),
    scale=st.floats(0.5, 2.0),
    shift=st.tuples(st.floats(-9, 9), st.floats(-9, 9)),
)
def test_a_known_motion_is_found(rotation: float, scale: float, shift: tuple[float, float]) -> None:
    found = register(GRID, moved(rotation, scale, shift))
    assert found.rotation == pytest.approx(rotation, abs=1e-9)
    assert found.scale == pytest.approx(scale, rel=1e-9)
    np.testing.assert_allclose(found.shift, shift, atol=1e-9)
    assert found.residual < 1e-9


def test_the_stated_uncertainties_are_those_of_many_or_few_units() -> None:
    random = np.random.default_rng(1)
    true = np.array([0.02, 1.004, 1.5, -0.7])
    off = []
    for _ in range(300):
        seen = moved(0.02, 1.004, (1.5, -0.7)) + random.normal(0, 0.05, GRID.shape)
        found = register(GRID, seen)
        sigma = np.array([found.rotation_sigma, found.scale_sigma, *found.shift_sigma])
        off.append((np.array([found.rotation, found.scale, *found.shift]) - true) / sigma)
    np.testing.assert_allclose(np.std(off, axis=0), 1.0, atol=0.12)
    # the four numbers that are fitted take half of what four units tell
    random = np.random.default_rng(2)
    few = GRID[[0, 6, 42, 48]]
    variance = [
        register(few, few + random.normal(0, 0.05, few.shape)).shift_sigma[0] ** 2 * len(few)
        for _ in range(1000)
    ]
    assert np.mean(variance) == pytest.approx(0.05**2, rel=0.1)


def test_the_scale_stays_and_unseen_units_do_not_count() -> None:
    found = register(GRID, moved(np.pi / 2, 1.1, (3.0, 0.0)))
    upright = found.upright(np.array([0.0, 2.0, 0.3]))
    np.testing.assert_allclose(upright, [2.0, 0.0, 0.3], atol=1e-12)
    seen = moved(0.1, 1.0, (0.0, 0.0))
    seen[3:9] = np.nan
    assert register(GRID, seen).rotation == pytest.approx(0.1, abs=1e-9)


def test_a_track_without_a_camera_has_no_pixels() -> None:
    points = sample("track").assign(camera_homography=(("row", "column"), np.full((3, 3), np.nan)))
    assert np.isnan(pixel_size(points, np.zeros(2)))


@pytest.mark.parametrize("static", [True, False])
def test_a_drive_by_a_force_has_no_axis(static: bool) -> None:
    response = xr.Dataset(
        {"drive_displacement": (("time", "xy"), np.zeros((5, 2)))},
        {"time": np.linspace(0.0, 1.0, 5), "direction": 0.0},
    )
    with refused("displaces no units", "drive.kind"):
        find_axis(TIMES, sine(TIMES), response, static=static)


@pytest.mark.parametrize("static", [True, False])
def test_a_side_that_slides_freely_is_no_turn_of_the_drive(static: bool) -> None:
    pushed = np.stack([-4.0 * TIMES**2, np.zeros_like(TIMES)], axis=1)
    slid = pushed + np.stack([np.zeros_like(TIMES), 3.0 * np.sin(TIMES)], axis=1)
    response = xr.Dataset(
        {"drive_displacement": (("time", "xy"), pushed)}, {"time": TIMES, "direction": 180.0}
    )
    found = find_axis(TIMES, slid, response, static=static, moved=np.array([True, False]))
    np.testing.assert_allclose(found.time[:-1], TIMES[:-1], atol=1e-4)
    assert np.isnan(found.turn)
    if found.lag is not None:
        assert found.lag.correlation == pytest.approx(1.0, abs=1e-6)
