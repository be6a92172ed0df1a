"""Similarities that are known, found again within the uncertainty that is stated."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.comparison import pixel_size, register
from tests.pipeline.samples import sample

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


def test_the_stated_uncertainties_are_those_of_the_result() -> None:
    random = np.random.default_rng(1)
    true = np.array([0.02, 1.004, 1.5, -0.7])
    off = []
    for _ in range(300):
        seen = moved(0.02, 1.004, (1.5, -0.7)) + random.normal(0, 0.05, GRID.shape)
        found = register(GRID, seen)
        sigma = np.array([found.rotation_sigma, found.scale_sigma, *found.shift_sigma])
        off.append((np.array([found.rotation, found.scale, *found.shift]) - true) / sigma)
    np.testing.assert_allclose(np.std(off, axis=0), 1.0, atol=0.12)


def test_few_units_leave_fewer_degrees_of_freedom() -> None:
    """The four numbers that are fitted take half of what four units tell."""
    random = np.random.default_rng(2)
    few = GRID[[0, 6, 42, 48]]
    variance = [
        register(few, few + random.normal(0, 0.05, few.shape)).shift_sigma[0] ** 2 * len(few)
        for _ in range(1000)
    ]
    assert np.mean(variance) == pytest.approx(0.05**2, rel=0.1)


def test_the_scale_is_not_taken_out_of_motions() -> None:
    found = register(GRID, moved(np.pi / 2, 1.1, (3.0, 0.0)))
    upright = found.upright(np.array([0.0, 2.0, 0.3]))
    np.testing.assert_allclose(upright, [2.0, 0.0, 0.3], atol=1e-12)


def test_units_that_were_not_seen_do_not_count() -> None:
    seen = moved(0.1, 1.0, (0.0, 0.0))
    seen[3:9] = np.nan
    assert register(GRID, seen).rotation == pytest.approx(0.1, abs=1e-9)


def test_a_track_without_a_camera_has_no_pixels() -> None:
    points = sample("track").assign(camera_homography=(("row", "column"), np.full((3, 3), np.nan)))
    assert np.isnan(pixel_size(points, np.zeros(2)))
