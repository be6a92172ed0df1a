"""The drive of a fit: the true motion without what stays with a unit, and with its covariance."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.calibration.experiments import tracked_specimen
from pipeline.calibration.experiments.measured_drive import SmoothedDrive, smooth_drive
from pipeline.calibration.inputs import TrackedMotion
from pipeline.posing import scene_of
from pipeline.problem.reading import load
from pipeline.runtime import ROOT
from sim.core import Floats
from sim.scene import Scene

SHAKEN = ROOT / "experiments/calibration/specimens/shaken.yaml"
SIGMA = np.array([0.01, 0.01, 0.001])
BIAS = np.array([0.1, 0.1, 0.01])
RATE, FRAMES = 300.0, 61
SHIFT = 0.05


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_of(load(SHAKEN), Path(SHAKEN).parent)


def course(time: Floats) -> Floats:
    """Displacement of the driven units: a push that begins with a jump of its velocity."""
    return np.asarray(3.0 * np.sin(2 * np.pi * 8.0 * time) * np.exp(-time / 0.1))


def tracked(random: np.random.Generator) -> xr.Dataset:
    """What a tracker sees of twelve units, whose places are all off by the same shift."""
    time = np.arange(FRAMES) / RATE
    motion = np.zeros((FRAMES, 12, 3))
    motion[..., 0] = course(time)[:, None] + SHIFT
    motion += SIGMA * random.normal(size=motion.shape)
    axes = ("time", "unit", "dof")
    variables = {
        "displacement": (axes, motion),
        "sigma": (axes, np.broadcast_to(SIGMA, motion.shape)),
        "timing": ("time", np.zeros(FRAMES, np.int8)),
    }
    return xr.Dataset(variables, {"unit": np.arange(12), "time": time})


def instants(found: SmoothedDrive) -> Floats:
    """(n_knots,) s."""
    motion = found.held.motion
    return np.asarray(motion.step * np.arange(len(motion.value)))


def along_x(found: SmoothedDrive) -> Floats:
    """(n_knots, n_held)."""
    return np.asarray(found.held.motion.value)[..., 0]


def test_the_motion_is_found_without_what_stays_with_a_unit(scene: Scene) -> None:
    found = smooth_drive(tracked(np.random.default_rng(1)), scene, BIAS)
    knots = instants(found)
    assert not found.coarse
    assert along_x(found)[0].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(along_x(found), np.tile(course(knots)[:, None], 2), atol=0.06)


def test_changes_have_the_covariance_of_the_noise(scene: Scene) -> None:
    """Over many draws: of the mean course of both units, at a knot in the middle."""
    random, errors, told = np.random.default_rng(2), [], []
    for _ in range(60):
        found = smooth_drive(tracked(random), scene, BIAS)
        middle = len(found.held.motion.value) // 2
        at = found.held.motion.step * middle
        errors.append(along_x(found)[middle] - course(np.array([at])))
        squares = [each.value[middle] ** 2 for each in found.changes if each.dof == 0]
        told.append(np.sum(squares) / 2)
    assert np.std(errors) == pytest.approx(np.sqrt(np.mean(told)), rel=0.2)
    assert abs(np.mean(errors)) < 3 * np.sqrt(np.mean(told) / 120)


def test_frames_without_a_unit_are_bridged_too_few_are_told(scene: Scene) -> None:
    track = tracked(np.random.default_rng(4))
    track["displacement"][20:26, 0] = np.nan
    found = smooth_drive(track, scene, BIAS)
    knots = instants(found)
    spread = [each.value**2 for each in found.changes if (each.place, each.dof) == (0, 0)]
    error = np.sqrt(np.sum(spread, axis=0))
    assert (np.abs(along_x(found)[:, 0] - course(knots)) < 5 * error + 1e-12).all()
    assert error.max() > 2 * np.median(error)
    sparse = tracked(np.random.default_rng(3)).isel(time=slice(None, None, 5))
    assert smooth_drive(sparse, scene, BIAS).coarse


def test_duplicate_frames_of_a_set_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    track = tracked(np.random.default_rng(5))
    track["timing"][10::20] = 1
    monkeypatch.setattr(datasets, "read", lambda *_: track)
    known = {"kind": "track", "name": "run", "problem": "shaken.yaml", "file": "run.nc"}
    read = tracked_specimen.read_track(TrackedMotion.model_validate(known), Path())
    np.testing.assert_array_equal(read["time"], np.delete(track["time"], np.s_[10::20]))
