"""A track that does not start at rest says so, on motions that are made up."""

from collections.abc import Callable

import numpy as np
import pytest

from pipeline.tracking.reference_frame import start_warning
from tests.pipeline.tracking.conftest import tracked

CENTRE = np.stack(np.meshgrid(*2 * [np.arange(8) * 15.0]), axis=-1).reshape(-1, 2)
BENT = 0.4 * np.stack([np.sin(CENTRE[:, 1] / 30), np.cos(CENTRE[:, 0] / 25)], axis=-1)
PIXEL = 0.4


def doubt(course: Callable[[float], float], shape: np.ndarray, off: float, frames: int = 9) -> str:
    """Says what of a motion of one shape is told where units are off the design, mm."""
    random = np.random.default_rng(5)
    noise = 0.004 * random.normal(size=(frames, *CENTRE.shape))
    made = np.array([course(frame) for frame in range(frames)])[:, None, None] * shape + noise
    made[:, 3] = np.nan
    residual = off / PIXEL * random.normal(size=CENTRE.shape)
    return start_warning(made, CENTRE, residual, PIXEL)


def test_a_first_frame_in_motion_is_told() -> None:
    told = doubt(lambda frame: 0.1 * frame, BENT, 0.1)
    assert "start the window where the specimen rests" in told
    assert "moves from the first frame on" in told
    assert "moves" in doubt(lambda frame: np.sin(0.2 * frame), BENT, 0.1, frames=3)


@pytest.mark.parametrize(
    ("course", "shape", "off"),
    [
        (lambda frame: 0.0 * frame, BENT, 0.15),
        (lambda frame: 0.02 * frame**2, BENT, 0.1),
        (lambda frame: max(0.0, frame - 1.0), BENT, 0.1),
        (lambda frame: 0.1 * frame, CENTRE / 60 + 1.0, 0.1),
        (lambda frame: 0.1 * frame, BENT, 0.005),
    ],
    ids=["rests", "sets in", "begins later", "the camera's own", "as the design"],
)
def test_a_start_at_rest_is_not_doubted(
    course: Callable[[float], float], shape: np.ndarray, off: float
) -> None:
    """With the tolerance of what is printed, about 0.1 mm; a hand moves the camera besides."""
    assert doubt(course, shape, off) == ""
    assert doubt(course, shape, off, frames=1) == ""


def test_units_far_off_the_design_are_told() -> None:
    assert "mm off the design" in doubt(lambda frame: 0.0 * frame, BENT, 0.4)
    assert doubt(lambda frame: 0.0 * frame, BENT, np.nan) == ""


@pytest.mark.parametrize("name", ["b_harmonic", "e_speckle", "f_silhouette"])
def test_no_clip_that_starts_at_rest_is_doubted(name: str) -> None:
    specimen, track, _ = tracked(name)
    told, seen = track.displacement[..., :2].astype(float), track.calibration
    assert start_warning(told, specimen.centre, seen.residual, seen.pixel) == ""
