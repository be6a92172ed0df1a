from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import problem
from pipeline.comparison.redrive import filter_held_motion, fit_spline, simulate_redriven
from pipeline.posing import PosedStructure, scene_of
from pipeline.runtime import UserError
from sim.scene import Scene, concrete_parameters, make_plan
from sim.solvers import LinearRamp, PrescribedMotion, Superposition, solve_case
from tests.pipeline import static

SIGMA = np.array([0.004, 0.004, 0.0006])
FIG2 = Path("experiments/fig2")


def tracked(scene: Scene, end: float, frames: int) -> tuple[xr.Dataset, np.ndarray]:
    """A track with noise of the scene's first case, and what it shows."""
    time = np.linspace(0, end, frames)
    plan = make_plan(scene, scene.lattice.vertices, time)
    values = concrete_parameters(scene, scene.lattice.vertices)
    motion = solve_case(plan.solver, values, scene.loads.cases[0])[0].reshape(frames, -1, 3)
    noise = SIGMA * np.random.default_rng(7).standard_normal(motion.shape)
    dims = ("time", "unit", "dof")
    track = xr.Dataset(
        {
            "displacement": (dims, motion + noise),
            "sigma": (dims, np.broadcast_to(SIGMA, motion.shape).copy()),
            "timing": ("time", np.zeros(frames, np.int8)),
        },
        {"time": time, "unit": scene.lattice.id},
    )
    return track, motion


@pytest.fixture(scope="module")
def pressed(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    folder = tmp_path_factory.mktemp("pressed")
    asked = problem.load(static.write(folder, static.HOLE, size=5, amplitude=5.0))
    return scene_of(asked, folder)


def test_motions_along_a_path_and_in_time_are_found_again(pressed: Scene) -> None:
    track, motion = tracked(pressed, 1.0, 40)
    held = filter_held_motion(track, pressed)
    assert len(held.unit) == 10
    assert held.driven.sum() == 5
    assert not held.assumed.any()
    np.testing.assert_allclose(held.noise.mean(axis=0), SIGMA, rtol=0.15)
    structure = PosedStructure(pressed, pressed.lattice.vertices)
    made = simulate_redriven(structure, held, track["time"].values)
    assert made.failure is None
    assert np.sqrt(np.mean((made.displacement - motion) ** 2)) < 0.5 * SIGMA[0]
    assert (made.drive_force[10:, 0] < 0).all()  # it pushes to the left
    scene = scene_of(problem.load(FIG2 / "problem.yaml", "quick"), FIG2)
    track, motion = tracked(scene, 0.5, 61)
    structure = PosedStructure(scene, scene.lattice.vertices)
    made = simulate_redriven(structure, filter_held_motion(track, scene), track["time"].values)
    share = np.sqrt(np.mean((made.displacement - motion) ** 2) / np.mean(motion**2))
    assert share < 0.02


def test_the_force_of_two_sides_that_were_pressed_is_the_first_ones(pressed: Scene) -> None:
    right = pressed.loads.driven
    left = np.unique(pressed.loads.clamped // 3)
    ways = LinearRamp(2.0, 1.0, np.pi), LinearRamp(2.0, 1.0)
    both = Superposition(ways, np.repeat(np.eye(2), 5, axis=0))
    drive = PrescribedMotion(np.concatenate([right, left]), both)
    scene = pressed.updated(cases=(drive,), supports=(), reference=None)
    track, _ = tracked(scene, 1.0, 12)
    structure = PosedStructure(scene, scene.lattice.vertices)
    made = simulate_redriven(structure, filter_held_motion(track, scene), track["time"].values)
    assert (made.drive_force[4:, 0] < -0.1).all()


def test_duplicate_frames_do_not_drive(pressed: Scene) -> None:
    track, _ = tracked(pressed, 1.0, 40)
    shown = np.arange(40)
    shown[5::6] -= 1
    late = track.assign(displacement=track["displacement"].copy(data=track["displacement"][shown]))
    late["timing"][5::6] = 1
    ours, good = (filter_held_motion(each, pressed) for each in (late, track))
    at = track["time"].values
    np.testing.assert_allclose(ours.motion(at), good.motion(at), atol=5 * SIGMA[0])
    assert not ours.filled.any()


def test_frames_that_show_nothing_are_bridged(pressed: Scene) -> None:
    track, _ = tracked(pressed, 1.0, 40)
    units = track["unit"].values
    clamped, driven, hidden = units[0], units[-1], pressed.lattice.id[pressed.loads.driven[1]]
    measured = track["displacement"]
    measured.loc[{"unit": clamped}] = np.nan
    measured.loc[{"unit": hidden}] = np.nan
    measured.loc[{"unit": driven, "time": track["time"][15:21]}] = np.nan
    held = filter_held_motion(track, pressed)
    ids = pressed.lattice.id[held.unit].tolist()
    place = {unit: ids.index(unit) for unit in (clamped, driven, hidden)}
    course = np.asarray(held.motion(track["time"].values))
    assert held.filled[place[driven]] == pytest.approx(6 / 40)
    assert set(np.flatnonzero(held.assumed)) == {place[clamped], place[hidden]}
    assert (course[:, place[clamped]] == 0).all()
    nominal = -5.0 * track["time"].values
    for unit in (driven, hidden):
        np.testing.assert_allclose(course[:, place[unit], 0], nominal, atol=4 * SIGMA[0])


def test_a_drive_that_nobody_saw_is_refused(pressed: Scene) -> None:
    track, _ = tracked(pressed, 1.0, 9)
    track["displacement"][:, pressed.loads.driven] = np.nan
    with pytest.raises(UserError, match="no driven unit was seen"):
        filter_held_motion(track, pressed)


def test_the_filter_departs_by_the_uncertainty_and_keeps_a_jump_of_speed() -> None:
    time = np.linspace(0, 2, 121)
    true = np.where(time > 0.2, 4.5 * np.sin(4 * np.pi * (time - 0.2)), 0.0)
    value = true + 0.005 * np.random.default_rng(1).standard_normal(121)
    made = fit_spline(time, value, np.full(121, 0.005))(time)
    assert np.sqrt(np.mean((made - value) ** 2)) == pytest.approx(0.005, rel=0.01)
    assert np.abs(made - true)[20:].max() < 0.02


def test_a_path_that_cannot_be_followed_is_kept_so_far(pressed: Scene) -> None:
    track, _ = tracked(pressed, 1.0, 20)
    into_its_neighbour = np.linspace(0, 3, 20)
    track["displacement"][:, pressed.loads.driven[0], 2] += into_its_neighbour
    structure = PosedStructure(pressed, pressed.lattice.vertices)
    made = simulate_redriven(structure, filter_held_motion(track, pressed), track["time"].values)
    assert "no equilibrium" in (made.failure or "")
    there = np.isfinite(made.displacement).all(axis=(1, 2))
    assert 0 < there.sum() < 20
    np.testing.assert_array_equal(there, np.isfinite(made.drive_force).all(axis=1))
