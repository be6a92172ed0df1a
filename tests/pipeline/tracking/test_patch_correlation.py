"""Tests that fits of patches find drawn poses, with the same bits however they are run."""

from typing import NamedTuple

import numpy as np
import pytest

from benchmarks.tracking.rendering import Renderer, View, eight_bit
from benchmarks.tracking.wild_clips import specimen
from pipeline.runtime import Picture
from pipeline.tracking.fit import (
    PoseFits,
    PoseFitter,
    TemplateGrid,
    Templates,
    frame_fit,
    learn_templates,
)
from pipeline.tracking.geometry import Camera, SpecimenOutlines
from sim.core import Floats, Image, Mask, Singles

VIEW = View(size=(400, 480), tilt=0.1)  # units at the rim are cut off, others out of view
LARGEST = np.array([0.4, 0.4, 0.04])  # mm and rad, of the motions


class Drawn(NamedTuple):
    """Holds squares that were at rest in one frame and have moved in another."""

    camera: Camera
    templates: Templates
    poses: Floats  # (units, 3) in the later frame, mm and rad
    inside: Mask  # (units,) which are whole in view
    clean: Singles  # the later frame without noise
    noisy: Image  # the same of 8 bits
    rest: Image  # the first one of 8 bits


def _camera(squares: SpecimenOutlines) -> Camera:
    """Makes the camera of the view: a pinhole that is tilted about x."""
    x, y = squares.centre.mean(axis=0)
    u, v = middle = (np.array(VIEW.size) - 1) / 2
    focal, cos, sin = VIEW.scale * VIEW.distance, np.cos(VIEW.tilt), np.sin(VIEW.tilt)
    stand = np.array([[1, 0, -x], [0, -cos, cos * y], [0, sin, VIEW.distance - sin * y]])
    matrix = np.array([[focal, 0, u], [0, focal, v], [0, 0, 1]]) @ stand
    return Camera(matrix / matrix[2, 2], middle, np.zeros(2), VIEW.size)


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    """Draws 9 x 9 dark squares, each of which moves by itself, and learns how they look."""
    squares = specimen()
    poses = np.random.default_rng(2).uniform(-LARGEST, LARGEST, (squares.count, 3))
    rest = Renderer(squares, lambda _: np.zeros((1, squares.count, 3)), VIEW)
    moved = Renderer(squares, lambda _: poses[None], VIEW)
    camera, pixel = _camera(squares), 1 / VIEW.scale
    grid = TemplateGrid(squares, VIEW.scale, (3 * VIEW.blur + 2) * pixel)
    first, clean = (each.clean(0.0).astype(np.float32) for each in (rest, moved))
    templates = learn_templates(first, camera, grid, VIEW.blur * pixel, pixel, "bare")
    corners = camera.project(squares.centre[:, None] + squares.outline)
    inside = np.asarray(((corners > 8) & (corners < np.array(VIEW.size) - 9)).all(axis=(1, 2)))
    images = (eight_bit(each.frame(0.0)) for each in (moved, rest))
    return Drawn(camera, templates, poses, inside, clean, *images)


class Fitting:
    """Fits the squares from rest, or followed: from near, with all that is then known of them."""

    def __init__(self, drawn: Drawn, followed: bool) -> None:
        self.fitter = PoseFitter(drawn.camera, drawn.templates)
        self.pose, self.light = self.fitter.start(1.0)
        self.known: dict[str, Floats] = {}
        if followed:
            random, units = np.random.default_rng(3), len(self.pose)
            self.pose = drawn.poses + 0.1 * random.uniform(-LARGEST, LARGEST, (units, 3))
            self.fitter.full = 3e7 * random.uniform(1.0, 2.0, units)  # more than is seen
            noise, hidden = random.uniform(2.0, 4.0, units), np.arange(units) % 3 == 0
            drift = 1e-5 * random.normal(size=(units, 3))
            self.known = {"noise": noise, "tight": np.where(hidden, 20.0, 0.0), "drift": drift}

    def fits(self, image: Picture, chosen: Mask | None = None) -> PoseFits:
        """Fits a frame."""
        return self.fitter.fit(image, self.pose, self.light, chosen, **self.known)

    def bits(self, image: Picture, chosen: Mask | None = None) -> np.ndarray:
        """Fits a frame; returns all that is found (units, numbers) as bits."""
        found = self.fits(image, chosen)
        table = np.concatenate([each.reshape(len(self.pose), -1) for each in found], axis=1)
        return table.view(np.uint64)


both_ways = pytest.mark.parametrize("followed", [False, True], ids=["from_rest", "followed"])


@pytest.mark.parametrize(
    ("followed", "noisy", "translation", "rotation"),
    [(False, False, 0.0006, 0.002), (False, True, 0.006, 0.018), (True, True, 0.007, 0.018)],
)
def test_poses_are_those_drawn(
    drawn: Drawn, followed: bool, noisy: bool, translation: float, rotation: float
) -> None:
    fits = Fitting(drawn, followed).fits(drawn.noisy if noisy else drawn.clean)
    error = (fits.pose - drawn.poses)[drawn.inside]
    rms = np.sqrt(np.mean(error**2, axis=0)) * [VIEW.scale, VIEW.scale, 180 / np.pi]
    assert (rms < [translation, translation, rotation]).all()
    assert np.isnan(fits.pose).any()  # none is found out of view
    if noisy:
        told = np.sqrt(np.diagonal(fits.scatter, axis1=1, axis2=2)[drawn.inside, :3])
        ratio = np.sqrt(np.mean((error / told) ** 2, axis=0))
        assert ratio.min() > 0.7
        assert ratio.max() < 1.5


@both_ways
def test_a_fit_repeated_has_the_same_bits(drawn: Drawn, followed: bool) -> None:
    fitting = Fitting(drawn, followed)
    first = fitting.bits(drawn.noisy)
    assert (fitting.bits(drawn.rest) != first).any()
    assert (fitting.bits(drawn.noisy) == first).all()
    assert (Fitting(drawn, followed).bits(drawn.noisy) == first).all()


@both_ways
def test_a_frame_of_8_bits_is_fitted_as_one_of_floats(drawn: Drawn, followed: bool) -> None:
    fitting = Fitting(drawn, followed)
    assert (fitting.bits(drawn.noisy.astype(np.float32)) == fitting.bits(drawn.noisy)).all()


@both_ways
def test_units_are_fitted_alone_as_with_others(
    drawn: Drawn, followed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = Fitting(drawn, followed)
    units = np.arange(len(drawn.poses))
    lone = np.stack([alone.bits(drawn.noisy, units == unit)[unit] for unit in units])
    for threads, at_once in ((1, 100), (4, 16), (4, 3)):
        monkeypatch.setattr(frame_fit, "_THREADS", threads)
        monkeypatch.setattr(frame_fit, "_UNITS_PER_TASK", at_once)
        fitting = Fitting(drawn, followed)
        assert (fitting.bits(drawn.noisy) == lone).all()
        some = units % 4 != 1
        assert (fitting.bits(drawn.noisy, some)[some] == lone[some]).all()
