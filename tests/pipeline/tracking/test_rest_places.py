"""Place units at rest as their outlines tell, and where these do not, as the design has them."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tracking.rendering import Renderer, View, eight_bit
from pipeline.tracking.detect import detect_lattice
from pipeline.tracking.fit import PoseFits
from pipeline.tracking.frames import import_video
from pipeline.tracking.geometry import (
    SpecimenOutlines,
    arm_swing,
    outlines_of_design,
    rotation_matrix,
)
from pipeline.tracking.reference_frame import RecordingSetup, RestPlaces, calibrate_camera
from pipeline.tracking.reference_frame.rest_places import estimate_rest_places
from tests.pipeline.virtual_lab.conftest import GRID

UNITS, SLENDER = 400, 40
USUAL, ALONG = 0.01, 0.2
"""Errors of outlines by the noise, across and along a slender unit, mm."""


def fits(pose: np.ndarray, deviation: np.ndarray, turn: np.ndarray) -> PoseFits:
    """Makes fits whose errors have standard deviations along axes that are turned."""
    axes = np.array([rotation_matrix(float(angle)) for angle in turn])
    curvature = np.zeros((len(pose), 5, 5))
    curvature[:, :2, :2] = np.einsum("uia,ua,uja->uij", axes, deviation**2, axes)
    one = np.ones(len(pose))
    places = np.einsum("uia,ua->ui", axes, pose)
    return PoseFits(np.c_[places, 0 * one], one, curvature, curvature, one, one, one, one, one)


def told(made: float) -> tuple[np.ndarray, RestPlaces]:
    """Estimates places of units made to a tolerance, some of them slender, and returns the true."""
    random = np.random.default_rng(3)
    deviation = np.full((UNITS, 2), USUAL)
    deviation[:SLENDER, 1] = ALONG
    error = np.hypot(deviation, deviation**2 / USUAL)
    true, turn = random.normal(0, 1, (2, UNITS, 2)) * [[[made]], [[1.0]]]
    seen = true + error * random.normal(size=(UNITS, 2))
    axes = np.array([rotation_matrix(float(angle)) for angle in turn[:, 0]])
    found = estimate_rest_places(fits(seen, deviation, turn[:, 0]))
    return np.einsum("uia,ua->ui", axes, true), found


@pytest.mark.parametrize("made", [0.0, 0.03, 0.15])
def test_places_are_as_far_off_as_stated(made: float) -> None:
    """Though outlines of slender units are off by millimetres."""
    true, found = told(made)
    error = found.offset - true
    assert np.linalg.norm(error[:SLENDER], axis=1).max() < 4 * max(made, USUAL)
    assert np.sqrt(np.mean(error[SLENDER:] ** 2)) < 1.5 * USUAL
    stated = np.einsum("uii->", found.covariance)
    assert np.sum(error**2) == pytest.approx(stated, rel=0.3, abs=0.1 * UNITS * USUAL**2)


def test_a_unit_that_is_not_seen_is_as_it_may_be_made() -> None:
    pose = np.random.default_rng(1).normal(0, 0.1, (300, 2))
    pose[7] = np.nan
    found = estimate_rest_places(fits(pose, np.full((300, 2), USUAL), np.zeros(300)))
    assert np.isnan(found.offset[7]).all()
    assert np.sqrt(found.covariance[7, 0, 0]) == pytest.approx(0.1, rel=0.15)
    none = estimate_rest_places(fits(np.full((2, 2), np.nan), np.ones((2, 2)), np.zeros(2)))
    assert np.isnan(none.offset).all()


def test_errors_of_places_swing_with_rotations() -> None:
    covariance = np.array([[0.04, 0.015], [0.015, 0.01]])
    arms = np.random.default_rng(2).multivariate_normal([0, 0], covariance, 20000)
    found = RestPlaces(np.zeros((1, 2)), covariance[None]).swing_variance(np.array([[0.7]]))
    wanted = np.var(arm_swing(np.array(0.7), arms), axis=0)
    np.testing.assert_allclose(found[0, 0], [*wanted, 0.0], rtol=0.05)


def test_a_slender_wedge_cut_too_thick_rests_where_the_design_has_it() -> None:
    """Its outline seems to lie along it, where the wedge is as thick."""
    lattice, slender = outlines_of_design(import_video.design(GRID)), [16, 32]

    def wedge(thicker: float) -> SpecimenOutlines:
        outline = lattice.outline.copy()
        wide, narrow = 1.0 + thicker, 0.4 + thicker
        corners = [[-narrow, 8.0], [-wide, -8.0], [wide, -8.0], [narrow, 8.0]]
        outline[slender] = np.nan
        outline[slender, :4] = corners
        return replace(lattice, outline=outline)

    still = np.zeros((1, lattice.count, 3))
    view = View(size=(360, 360), scale=3.0)
    image = eight_bit(Renderer(wedge(0.05), lambda _: still, view).frame(0.0))
    (seen, *_) = detect_lattice(image, lattice, 3.0)
    found = calibrate_camera(image, wedge(0.0), seen, RecordingSetup())
    assert np.linalg.norm(found.outlines.pose[slender, :2], axis=1).min() > 0.1
    assert np.linalg.norm(found.residual, axis=1).max() < 0.1
