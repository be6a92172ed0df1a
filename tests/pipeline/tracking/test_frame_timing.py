"""Faults of timing and stated uncertainties, on motions that are made up."""

import numpy as np
import pytest

from pipeline.tracking.frames import has_uneven_intervals
from pipeline.tracking.motion import frame_timing, uncertainty, video_tracking
from sim.core import Floats

NOISE = 0.004
FRAMES = 60
CENTRE = np.stack(np.meshgrid(*2 * [np.arange(8) * 15.0]), axis=-1).reshape(-1, 2)


def motion(clock: np.ndarray, seed: int = 0) -> np.ndarray:
    """Units that swing in two shapes, and noise."""
    random = np.random.default_rng(seed)
    swing = np.sin(2 * np.pi * clock / 25)[:, None] * CENTRE[:, 0] / 60
    sway = np.cos(2 * np.pi * clock / 37)[:, None] * CENTRE[:, 1] / 80
    turn = 0.2 * swing * np.where(CENTRE.sum(axis=1) / 15 % 2 == 0, 1, -1)
    made = np.stack([swing, sway, turn], axis=-1)
    return made + NOISE * random.normal(size=made.shape)


def faults(
    moved: Floats, time: Floats | None = None, same: tuple[int, ...] = (), coded: float = 0.0
) -> dict[int, int]:
    """Finds faults of motions whose frames the file takes to be even, some shown again.

    A fifth of the pixels change from frame to frame, and some where a codec codes a picture again.
    """
    time = np.arange(len(moved)) / 30 if time is None else time
    changed = np.where(np.isin(np.arange(len(moved)), same), coded, 0.2)
    told = frame_timing.timing_faults(time, moved, np.full(moved.shape, NOISE), changed)
    return {int(frame): int(told[frame]) for frame in np.flatnonzero(told)}


def test_even_frames_and_a_specimen_at_rest_have_no_fault() -> None:
    assert faults(motion(np.arange(FRAMES, dtype=float))) == {}
    moved = motion(np.maximum(np.arange(FRAMES) - 20.0, 0.0))
    assert faults(moved, same=tuple(range(1, 20))) == {}
    assert faults(motion(np.arange(FRAMES)), same=tuple(range(20, 25))) == {}


@pytest.mark.parametrize("frame", [12, 25, 40])
@pytest.mark.parametrize("missing", [1, 2, 5])
def test_a_gap_is_found_by_the_motion_and_by_the_stamps(frame: int, missing: int) -> None:
    clock = np.arange(FRAMES, dtype=float)
    clock[frame:] += missing
    assert faults(motion(clock)) == {frame: frame_timing.DROPPED}
    assert faults(motion(clock), clock / 30) == {frame: frame_timing.DROPPED}


def test_a_varying_rate_is_no_row_of_gaps_nor_of_rounded_stamps() -> None:
    clock = np.cumsum(np.random.default_rng(3).choice([1.0, 1.5, 2.0, 3.0], FRAMES))
    assert faults(motion(clock), clock / 60) == {}
    steady = np.arange(FRAMES) / 30
    assert not has_uneven_intervals(np.round(steady, 3))
    assert has_uneven_intervals(np.delete(steady, [7, 30]))


def test_pixels_that_change_by_more_than_a_level_are_counted() -> None:
    before = np.full((100, 100), 90, dtype=np.uint8)
    for differing, by, share in ((10_000, 1, 0.0), (49, 2, 0.0049)):
        image = before.copy()
        image.flat[:differing] += by
        assert video_tracking._changed_share(before, image) == share


def shown_again(frame: int) -> Floats:
    """Returns a motion in which a frame shows the instant before again."""
    clock = np.arange(FRAMES, dtype=float)
    clock[frame:] -= 1
    moved = motion(clock)
    moved[frame] = moved[frame - 1]
    return moved


@pytest.mark.parametrize("coded", [0.0, 0.004, 0.018, 0.045])
def test_frames_shown_again_are_found(coded: float) -> None:
    """Of whatever quality the video is coded in."""
    assert faults(shown_again(25), same=(25,), coded=coded) == {25: frame_timing.DUPLICATE}
    held = np.arange(FRAMES) - np.clip(np.arange(FRAMES) - 24, 0, 4)  # four in a row
    again = tuple(range(25, 29))
    found = dict.fromkeys(again, frame_timing.DUPLICATE)
    if coded < 0.005:
        assert faults(motion(held), same=again, coded=coded) == found


@pytest.mark.parametrize("frame", [12, 25, 40])
def test_a_frame_shown_in_place_of_a_lost_one_is_no_gap(frame: int) -> None:
    moved = motion(np.arange(FRAMES, dtype=float))
    moved[frame] = moved[frame - 1]
    assert faults(moved, same=(frame,), coded=0.01) == {frame: frame_timing.DUPLICATE}


def test_a_video_that_starts_slowly_shows_no_frame_again() -> None:
    moved = motion(1e-3 * np.arange(FRAMES) ** 2)
    noise = np.full(moved.shape, NOISE)
    changed = np.linspace(0, 1, FRAMES) ** 2
    assert not frame_timing.timing_faults(np.arange(FRAMES) / 30, moved, noise, changed).any()


def test_a_specimen_at_rest_shows_no_frame_again() -> None:
    """Though a codec codes some of its pictures anew and leaves others."""
    moved = motion(np.zeros(FRAMES))
    assert faults(moved, same=tuple(set(range(FRAMES)) - {*range(0, FRAMES, 4)})) == {}


def test_a_turning_point_is_no_frame_shown_again() -> None:
    """Though two frames with it midway are nearly the same."""
    moved = np.zeros((FRAMES, len(CENTRE), 3))
    moved[..., 0] = 2 * np.cos(2 * np.pi * (np.arange(FRAMES)[:, None] - 24.6) / 20)
    assert faults(moved, same=(25,), coded=0.01) == {}


@pytest.mark.parametrize("step", [0.05, 0.5, 5.0])
def test_the_onset_of_motion_is_no_fault(step: float) -> None:
    """A specimen that rests in the beginning and is then driven, or creeps and is then turned."""
    clock = np.maximum(np.arange(FRAMES) - 20.0, 0.02 * (np.arange(FRAMES) - 20.0))
    moved = step * clock[:, None, None] * (1 + CENTRE[:, :1] / 60) * np.array([1.0, -0.3, 0.01])
    moved += NOISE * np.random.default_rng(1).normal(size=moved.shape)
    assert faults(moved) == {}


def wave(clock: np.ndarray) -> np.ndarray:
    """Units over which a wave runs, of twelve frames and ten units, and noise."""
    made = np.zeros((len(clock), len(CENTRE), 3))
    made[..., 0] = 0.4 * np.sin(2 * np.pi * (clock[:, None] / 12 - CENTRE[:, 0] / 150))
    return made + NOISE * np.random.default_rng(1).normal(size=made.shape)


def test_faults_of_a_quick_wave_are_found() -> None:
    clock = np.arange(FRAMES, dtype=float)
    clock[15:] += 1
    clock[40:] -= 1
    found = faults(wave(clock), same=(40,))
    assert found == {15: frame_timing.DROPPED, 40: frame_timing.DUPLICATE}


@pytest.mark.parametrize("frames", [8, 12, 16])
def test_the_turning_points_of_a_swing_are_no_faults(frames: int) -> None:
    moved = np.zeros((FRAMES, len(CENTRE), 3))
    moved[..., 0] = np.cos(2 * np.pi * (np.arange(FRAMES)[:, None] - 0.5) / frames)
    moved += NOISE * np.random.default_rng(2).normal(size=moved.shape)
    assert faults(moved) == {}


@pytest.mark.parametrize("back", [0.35, 2.0])
def test_a_return_to_set_out_another_way_is_no_gap(back: float) -> None:
    """A stage goes ten steps along x, returns at once and goes along y."""
    moved = np.zeros((22, len(CENTRE), 3))
    moved[:11, :, 0] = back / 10 * np.arange(11)[:, None]
    moved[11:, :, 1] = back / 10 * np.arange(11)[:, None]
    moved += 0.02 * NOISE * back * np.random.default_rng(6).normal(size=moved.shape)
    assert faults(moved) == {}


@pytest.mark.parametrize("rate", [30.0, 60.0, 240.0])
def test_stamps_that_count_milliseconds_are_evened(rate: float) -> None:
    """But those of a camera that dropped frames keep the gaps, and others are as they are."""
    steady = np.delete(np.arange(200.0), [70, 71, 130]) / rate
    np.testing.assert_allclose(frame_timing.unrounded(np.round(steady, 3)), steady, atol=2e-4)
    varying = np.cumsum(np.random.default_rng(3).uniform(0.9, 1.1, 200)) / rate
    assert (frame_timing.unrounded(varying) == varying).all()


def test_stamps_of_no_steps_tell_no_fault() -> None:
    coarse = np.floor(np.arange(FRAMES) / 5) / 1000
    with np.errstate(all="raise"):
        assert faults(motion(np.arange(FRAMES)), coarse) == {}


def test_stated_uncertainty_is_that_of_the_noise() -> None:
    moved, steady = motion(np.arange(FRAMES, dtype=float)), np.ones(FRAMES, dtype=bool)
    seen_badly = moved.copy()
    moved[20:30, 5] = np.nan
    told = uncertainty.calibrate_sigma(moved, np.full(moved.shape, NOISE / 5), CENTRE, steady)
    assert np.median(told) == pytest.approx(NOISE, rel=0.15)
    seen_badly[:, 9] += 4 * NOISE * np.random.default_rng(1).normal(size=(FRAMES, 3))
    told = uncertainty.calibrate_sigma(seen_badly, np.full(moved.shape, NOISE), CENTRE, steady)
    assert np.median(told[:, 9]) > 2.5 * np.median(told)


@pytest.mark.parametrize("share", [0.15, 0.35, 0.6])
def test_a_short_step_is_no_frame_shown_again(share: float) -> None:
    """Only pixels tell: a specimen may stick for a frame."""
    clock = np.arange(FRAMES, dtype=float)
    clock[25:] -= 1 - share
    assert faults(motion(clock)).get(25) != frame_timing.DUPLICATE
    assert faults(motion(clock), same=(25,)).get(25) == frame_timing.DUPLICATE
