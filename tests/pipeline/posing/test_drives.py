from pathlib import Path

import numpy as np
import pytest

from pipeline.posing import StoppedError, scene_of
from pipeline.problem import from_canonical, load
from pipeline.problem.identity import canonical_json
from pipeline.runtime import UserError
from sim.core import SimulationError
from sim.scene import Scene, SceneError, simulate
from tests.pipeline import static
from tests.tables import cases, refused

PUSH = "{ kind: force, units: right, amplitude: 0.5 N, direction: 180 deg, free: [uy] }"
TURN = "{ kind: rotation, units: { units: [[2, 0]] }, amplitude: 10 deg }"
TIMES = np.array([0.5, 1.0])
RIGHT = [4, 9, 14, 19, 24]


def written(folder: Path, drive: str, horizon: str = "duration: 1 s, steps: 4") -> Path:
    path = static.write(folder, static.HOLE, size=5)
    text = path.read_text()
    start, end = text.index("drive:"), text.index("constraints:")
    rest = text[end:].replace("samples: 9", "samples: 24")
    path.write_text(f"{text[:start]}{drive}\nhorizon: {{ {horizon} }}\n{rest}")
    return path


def posed(folder: Path, drive: str, horizon: str = "duration: 1 s, steps: 4") -> Scene:
    path = written(folder, drive, horizon)
    return scene_of(load(path), folder).objective.reference  # type: ignore[return-value]


def moved(scene: Scene) -> np.ndarray:
    return np.asarray(simulate(scene, vertices=scene.lattice.vertices).displacement[0])


def test_a_force_is_shared_by_units_and_a_moment_turns_one(tmp_path: Path) -> None:
    scene = posed(tmp_path, f"drive: {PUSH}")
    (case,) = scene.loads.cases
    forces = case.forces(np.array([0.5, 1.0]))
    np.testing.assert_allclose(forces[:, :, 0], [[-0.05] * 5, [-0.1] * 5])
    np.testing.assert_array_equal(scene.loads.driven, RIGHT)
    response = simulate(scene, vertices=scene.lattice.vertices)
    end = np.asarray(response.displacement[0, -1])[RIGHT]
    assert (end[:, 0] < -0.01).all()
    assert np.abs(end[:, 1]).max() > 1e-3
    np.testing.assert_array_equal(end[:, 2], 0.0)
    np.testing.assert_allclose(response.drive_force[0, :, 0], -0.125 * np.arange(1, 5))
    turned = posed(tmp_path, f"drive: {TURN}")
    np.testing.assert_allclose(moved(turned)[-1, 2], [0.0, 0.0, np.deg2rad(10.0)])
    seen = simulate(turned, vertices=turned.lattice.vertices).observables[0]
    moment = float(seen.reaction[-1, 2, 2])
    torque = f"{{ kind: torque, units: {{ units: [[2, 0]] }}, amplitude: {moment} N mm }}"
    loaded = posed(tmp_path, f"drive: {torque}")
    np.testing.assert_allclose(moved(loaded)[-1], moved(turned)[-1], atol=1e-8)


def test_several_drives_act_at_once_in_all_directions(tmp_path: Path) -> None:
    scene = posed(tmp_path, f"drives:\n  - {PUSH}\n  - {TURN}")
    np.testing.assert_array_equal(scene.loads.driven, [2, *RIGHT])
    np.testing.assert_array_equal(scene.loads.cases[0].leading, RIGHT)
    end = moved(scene)[-1]
    np.testing.assert_allclose(end[2], [0.0, 0.0, np.deg2rad(10.0)])
    alone = moved(posed(tmp_path, f"drive: {TURN}"))[-1]
    assert (end[RIGHT, 0] < alone[RIGHT, 0]).all()
    push = PUSH.replace("direction: 180 deg, free: [uy]", "directions: [180 deg, 90 deg]")
    asked = load(written(tmp_path, f"drives:\n  - {push}\n  - {TURN}"))
    assert from_canonical(canonical_json(asked)) == asked
    scene = scene_of(asked, tmp_path)
    assert len(scene.loads.cases) == 2
    ends = [case.forces(np.array([1.0]))[0, -1, :2] for case in scene.loads.cases]
    np.testing.assert_allclose(ends, [[-0.1, 0.0], [0.0, 0.1]], atol=1e-12)


def test_load_cases_have_the_weights_that_any_drive_gives(tmp_path: Path) -> None:
    two = "kind: force, amplitude: 5 N, directions: [180 deg, 90 deg]"
    first = f"{{ {two}, units: right }}"
    weighted = f"{{ {two}, units: {{ units: [[2, 0]] }}, weights: [0.9, 0.1] }}"
    for drives in ((first, weighted), (weighted, first), (weighted, PUSH)):
        asked = load(written(tmp_path, "drives:\n" + "".join(f"  - {each}\n" for each in drives)))
        assert asked.drive.case_weights == (0.9, 0.1)
    other = first.replace(" }", ", weights: [0.5, 0.5] }")
    path = written(tmp_path, f"drives:\n  - {other}\n  - {weighted}")
    with refused("(0.5, 0.5) by one drive and (0.9, 0.1) by another", "drives", "once"):
        load(path)


RAMP = (
    "{ kind: linear_ramp, units: right, amplitude: 9 mm, duration: 1 s, direction: 180 deg,"
    " free: [uy] }"
)
PLATES = """supports:
  - { units: left, clamp: [ux, theta] }
  - { units: bottom, clamp: [uy, theta] }
drives:
  - { units: right, amplitude: 9 mm, direction: 180 deg, free: [uy], KIND }
  - { units: top, amplitude: 6 mm, direction: 270 deg, free: [ux], KIND }
""".replace("KIND", "kind: linear_ramp, duration: 1 s")


def test_plates_on_rollers_share_the_units_at_corners(tmp_path: Path) -> None:
    path = written(tmp_path, PLATES)
    path.write_text(path.read_text().replace("supports:\n  - units: left\n", "", 1))
    scene = scene_of(load(path), tmp_path).objective.reference
    assert scene is not None
    end = moved(scene)[-1].reshape(5, 5, 3)  # row by row
    np.testing.assert_allclose(end[:, 4, 0], -9.0)
    np.testing.assert_allclose(end[4, :, 1], -6.0)
    np.testing.assert_array_equal(end[:, 0, 0], 0.0)
    np.testing.assert_array_equal(end[0, :, 1], 0.0)
    assert -6.0 < end[2, 4, 1] < 0.0
    text = path.read_text()
    path.write_text(text.replace(", free: [uy]", ""))
    with refused("unit [4, 4] is driven twice, along uy", "drives[1].units"):
        load(path)
    path.write_text(text.replace("clamp: [uy, theta]", "clamp: [ux, theta]"))
    with refused("unit [4, 0] is driven and clamped", "drives[0].units"):
        load(path)


def test_no_load_of_a_range_moves_what_is_clamped(tmp_path: Path) -> None:
    roller = "supports:\n  - { units: left }\n  - { units: bottom, clamp: [uy] }\n"
    path = written(tmp_path, f"{roller}drive: {RAMP}")
    text = path.read_text().replace("supports:\n  - units: left\n", "", 1)
    path.write_text(text)
    assert len(load(path).supports) == 2
    path.write_text(text.replace("intact", "intact, loads: { directions: [180 deg, 200 deg] }"))
    with refused("unit [4, 0] is driven and clamped", "drive.units"):
        load(path)


def test_a_force_has_a_course_in_time(tmp_path: Path) -> None:
    shaken = PUSH.replace("}", ", frequency: 4 Hz }")
    scene = posed(tmp_path, f"drive: {shaken}", "periods: 1, samples: 20")
    assert not scene.loads.static
    assert scene.loads.drive_frequency == 4.0
    response = simulate(scene, vertices=scene.lattice.vertices)
    put_on = -0.5 * np.sin(8 * np.pi * response.times)
    np.testing.assert_allclose(response.drive_force[0, :, 0], put_on, atol=1e-12)
    assert np.abs(np.asarray(response.displacement[0])[:, RIGHT, 0]).max() > 0.01


def test_a_late_moment_is_followed_by_steps_of_its_size(tmp_path: Path) -> None:
    turn = "kind: torque, units: { units: [[2, 0]] }, amplitude: 2 N mm, width: 5 ms, delay: 40 ms"
    scene = posed(tmp_path, f"drive: {{ {turn} }}", "duration: 0.1 s, samples: 21")
    ways = (scene.updated(integrator=name) for name in ("implicit", "explicit"))
    one, other = (moved(way)[:, 2, 2] for way in ways)
    assert np.abs(one).max() > 0.005
    np.testing.assert_allclose(one, other, atol=0.01 * np.abs(one).max())


def test_a_driven_edge_may_slide(tmp_path: Path) -> None:
    ramp = "{ kind: linear_ramp, units: right, amplitude: 3 mm, duration: 1 s, directions: [0 deg]"
    held, free = (moved(posed(tmp_path, f"drive: {ramp}{more}}}")) for more in ("", ", free: [uy]"))
    np.testing.assert_array_equal(held[:, RIGHT, 1], 0.0)
    assert np.abs(free[-1, RIGHT, 1]).max() > 1e-3
    np.testing.assert_allclose(free[-1, RIGHT, 0], 3.0)


@cases("posing", "drive, words")
def test_what_has_no_meaning_is_refused(tmp_path: Path, drive: str, words: tuple[str, ...]) -> None:
    with pytest.raises(UserError) as told:
        load(written(tmp_path, drive))
    assert all(word in str(told.value) for word in words), told.value


@cases("posing", "drive, key")
def test_a_stop_blames_the_size_of_the_drive(tmp_path: Path, drive: str, key: str) -> None:
    series = "time (s),ux (mm),uy (mm),theta (rad)\n0,0,0,0\n2,1,0,0\n"
    (tmp_path / "push.csv").write_text(series)
    asked = load(path := written(tmp_path, drive, "duration: 1 s, samples: 5"))
    stopped = StoppedError(SimulationError("stuck"), scene_of(asked, tmp_path), "altered", TIMES)
    told = stopped.explain(asked, path)
    assert told.key == key
    assert key in str(told.remedy)
    assert ("solver.accuracy" in str(told.remedy)) is not asked.static


def test_forces_on_what_nothing_holds_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path, f"drive: {PUSH}")
    path.write_text(path.read_text().replace("units: left", "units: left\n    clamp: [ux]"))
    with pytest.raises(UserError, match="against load case 0: it can move or turn as one"):
        scene_of(load(path), tmp_path)


def test_a_scene_without_a_meaning_is_told_by_its_own_key(tmp_path: Path) -> None:
    asked = load(written(tmp_path, f"drive: {RAMP}"))
    error = SceneError("the forces balance; drive one side", "objective.reaction")
    stopped = StoppedError(error, scene_of(asked, tmp_path), "initial", TIMES)
    with refused("the forces balance", "objective.reaction", "drive one side"):
        raise stopped.explain(asked, Path("problem.yaml"))
