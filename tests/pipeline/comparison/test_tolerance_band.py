from pathlib import Path

import numpy as np
import pytest

from pipeline import problem
from pipeline.comparison.tolerance_band import Specimens, band_limits, sample_specimens, widen_band
from pipeline.posing import PosedStructure, scene_of
from pipeline.problem import Problem
from pipeline.problem.sections import Tolerances
from pipeline.problem.sections.prediction import Assembly
from tests.pipeline import static
from tests.tables import cases

SIGMA = np.array([0.01, 0.01, 0.001])
SIZES = "geometry: 0.03, ligaments: 0.1, stiffness: 0.05"
TIMES = np.array([0.4, 0.7, 1.0])


def draws(study: tuple[Problem, Path], **changes: object) -> Specimens:
    asked, folder = study
    changed = asked.prediction.model_copy(update=changes)
    scene = scene_of(asked, folder)
    structure = PosedStructure(scene, scene.lattice.vertices)
    return sample_specimens(asked.model_copy(update={"prediction": changed}), structure, TIMES)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Problem, Path]:
    folder = tmp_path_factory.mktemp("band")
    more = static.HOLE + f"prediction: {{ samples: 64, {SIZES} }}\n"
    return problem.load(static.write(folder, more, size=5, amplitude=5.0)), folder


@pytest.fixture(scope="module")
def samples(study: tuple[Problem, Path]) -> Specimens:
    return draws(study)


def test_the_band_holds_the_next_specimens(study: tuple[Problem, Path], samples: Specimens) -> None:
    """95 % of what a tracker measures of 40 others, drawn alike, at their free units."""
    others = draws(study, seed=1, samples=40)
    noise = SIGMA * np.random.default_rng(2).standard_normal(others.displacement.shape)
    measured = others.displacement + noise
    low, _, high = widen_band(band_limits(samples.displacement, 0.95), SIGMA, 0.95)
    np.testing.assert_allclose(widen_band(np.zeros((3, 1)), np.array([2.0]), 0.95)[2], 3.92, 1e-4)
    free = np.ptp(samples.displacement[:, -1, :, 0], axis=0) > 0
    inside = ((measured >= low) & (measured <= high))[:, :, free].mean(axis=(1, 2))
    assert free.sum() == 14
    np.testing.assert_allclose(inside.mean(axis=0), 0.95, atol=0.03)
    forces = band_limits(samples.drive_force[..., 0], 0.95)
    held = (others.drive_force[..., 0] >= forces[0]) & (others.drive_force[..., 0] <= forces[2])
    assert held.mean() == pytest.approx(0.95, abs=0.06)


def test_without_tolerances_every_specimen_is_the_design(study: tuple[Problem, Path]) -> None:
    exact = Assembly.model_validate({"shift": "0 mm", "turn": "0 deg"})
    nothing = dict.fromkeys(Tolerances.model_fields, 0.0) | {"assembly": exact}
    made = draws(study, samples=3, **nothing)
    assert np.ptp(made.displacement, axis=0).max() < 1e-7
    assert made.failures == ()


def test_failures_are_counted(study: tuple[Problem, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim.structure.perturbation.MOST_ROUNDS", 1)
    made = draws(study, samples=3, geometry=0.5)
    assert len(made.failures) == 3
    assert "overlap" in made.failures[0]
    assert made.displacement.shape == (0, 3, 24, 3)


def test_specimens_are_assembled_off_their_places(study: tuple[Problem, Path]) -> None:
    """As those of the virtual lab are: nothing else is off here, and yet they differ."""
    nothing = dict.fromkeys(set(Tolerances.model_fields) - {"assembly"}, 0.0)
    wide = Assembly.model_validate({"shift": "0.3 mm", "turn": "1 deg"})
    usual, wider = (draws(study, samples=6, **nothing, **more) for more in ({}, {"assembly": wide}))
    spread = [made.displacement[:, -1].std(axis=0).max() for made in (usual, wider)]
    assert 0.01 < spread[0] < spread[1]
    shifted = Assembly.model_validate({"shift": "0.3 mm", "turn": "0 deg"})
    made = draws(study, samples=6, **nothing, assembly=shifted)
    assert made.displacement[:, -1].std(axis=0).max() > 0.01


def test_limits_hold_the_next_draw() -> None:
    """Over many bands of 64 draws, a 65th is inside as often as stated."""
    drawn = np.random.default_rng(4).standard_normal((65, 20_000))
    low, middle, high = band_limits(drawn[:64], 0.95)
    assert np.mean((drawn[64] > low) & (drawn[64] < high)) == pytest.approx(0.95, abs=0.005)
    assert abs(middle.mean()) < 0.01


@cases("comparison", "more, expected")
def test_sizes_given_tried_or_usual(tmp_path: Path, more: str, expected: dict[str, float]) -> None:
    asked = problem.load(static.write(tmp_path, static.HOLE + more, size=5))
    assert asked.tolerances.model_dump(include=set(expected)) == expected
