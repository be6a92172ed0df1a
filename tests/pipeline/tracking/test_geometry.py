from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.tracking.geometry import (
    Camera,
    fit_camera,
    lens_variance,
    rigid_motion,
    robust_motion,
    sigma_point_cameras,
)

seeds = st.integers(0, 2**32 - 1)


def some_camera(random: np.random.Generator) -> Camera:
    matrix = np.array([[4.0, 0.1, 30.0], [0.1, -4.0, 970.0], [0.0, 0.0, 1.0]])
    matrix[:2, :2] += 0.1 * random.normal(size=(2, 2))
    matrix[2, :2] = 1e-4 * random.normal(size=2)
    return Camera(
        matrix, 500 + 10 * random.normal(size=2), 0.02 * random.normal(size=2), (1000, 1000)
    )


@given(seeds)
def test_what_a_camera_sees_is_where_it_was(seed: int) -> None:
    random = np.random.default_rng(seed)
    camera = some_camera(random)
    points = random.uniform(0, 220, (50, 2))
    np.testing.assert_allclose(camera.unproject(camera.project(points)), points, atol=1e-9)


@given(seeds, st.sampled_from([0.0, 1e-4, 0.7]))
def test_slopes_of_what_a_camera_sees_are_its_differences(seed: int, fisheye: float) -> None:
    random = np.random.default_rng(seed)
    camera = replace(some_camera(random), fisheye=fisheye)
    points = random.uniform(0, 220, (20, 2))
    first = np.concatenate([camera.homography.ravel()[:8], camera.centre, camera.radial, [fisheye]])

    def seen(moved: np.ndarray) -> np.ndarray:
        matrix = np.append(moved[:8], 1.0).reshape(3, 3)
        lens = {"centre": moved[8:10], "radial": moved[10:12], "fisheye": moved[12]}
        return replace(camera, homography=matrix, **lens).project(points)

    def difference(along: np.ndarray) -> np.ndarray:
        return (seen(first + along) - seen(first - along)) / (2 * along.sum())

    steps = np.array([1e-4, 1e-4, 1e-2, 1e-4, 1e-4, 1e-2, 1e-7, 1e-7, 1e-2, 1e-2, 1e-4, 1e-4, 1e-5])
    slopes = camera.parameter_slopes(points)
    for index in range(13 if fisheye else 12):
        rough = difference(np.eye(13)[index] * steps[index])
        np.testing.assert_allclose(
            slopes[..., index], rough, atol=1e-5 * np.abs(rough).max() + 1e-7, err_msg=str(index)
        )
    for axis, along in enumerate(1e-2 * np.eye(2)):
        rough = (camera.project(points + along) - camera.project(points - along)) / 0.02
        np.testing.assert_allclose(camera.jacobian(points)[..., axis], rough, atol=1e-7)


@given(st.integers(0, 20))
def test_a_camera_is_found_from_what_it_sees(seed: int) -> None:
    random = np.random.default_rng(seed)
    camera = some_camera(random)
    points = np.stack(np.meshgrid(*2 * [np.linspace(0, 220, 10)]), axis=-1).reshape(-1, 2)
    pixels = camera.project(points)
    found = fit_camera(points, pixels, camera.size, 1e-3)
    np.testing.assert_allclose(found.project(points), pixels, atol=2e-3)


def test_a_lens_of_strong_distortion_is_no_outlier_of_the_prior() -> None:
    camera = some_camera(np.random.default_rng(0))
    camera = replace(camera, radial=np.array([-0.25, 0.06]))
    points = np.stack(np.meshgrid(*2 * [np.linspace(20, 200, 9)]), axis=-1).reshape(-1, 2)
    noise = 0.03 * np.random.default_rng(1).normal(size=points.shape)
    found = fit_camera(points, camera.project(points) + noise, camera.size, 0.03)
    np.testing.assert_allclose(found.radial, camera.radial, atol=0.01)


@pytest.mark.slow
def test_errors_of_a_lens_are_as_large_as_their_variance_says() -> None:
    """A small specimen in the middle travels to the corner of the picture, and turns on the way."""
    random, ratios = np.random.default_rng(2), []
    points = np.stack(np.meshgrid(*2 * [np.linspace(80, 140, 5)]), axis=-1).reshape(-1, 2)
    motion = np.tile([70.0, -60.0, 0.2], (1, len(points), 1))
    for _ in range(30):
        camera = some_camera(random)
        seen = camera.project(points) + 0.05 * random.normal(size=points.shape)
        found = fit_camera(points, seen, camera.size, 0.05)
        alike = sigma_point_cameras(points, seen, found)
        ((_, variance),) = lens_variance(found, alike, points, motion)
        told = np.sqrt(variance)[0, :, :2]
        moved = found.unproject(camera.project(points + motion[0, :, :2]))
        error = moved - found.unproject(camera.project(points)) - motion[0, :, :2]
        assert told.max() > 0.02  # a tenth of a pixel
        ratios.append(np.mean((error / told) ** 2))
    assert 0.7 < np.sqrt(np.mean(ratios)) < 1.4


@given(seeds)
def test_a_rigid_motion_is_found_exactly(seed: int) -> None:
    random = np.random.default_rng(seed)
    turn, shift = random.uniform(-3, 3), random.normal(size=2)
    points = random.normal(size=(int(random.integers(2, 9)), 2))
    cos, sin = np.cos(turn), np.sin(turn)
    moved = points @ np.array([[cos, sin], [-sin, cos]]) + shift
    found, by = rigid_motion(points, moved)
    np.testing.assert_allclose(found, turn, atol=1e-9)
    np.testing.assert_allclose(by, shift, atol=1e-9)


def test_an_outlier_does_not_move_a_unit() -> None:
    points = np.random.default_rng(3).normal(size=(8, 2))
    moved = points + np.array([0.3, -0.2])
    moved[4] += 5.0
    turn, shift, weight = robust_motion(points, moved, 1e-3)
    np.testing.assert_allclose([turn, *shift], [0, 0.3, -0.2], atol=1e-6)
    assert weight[4] == 0.0
