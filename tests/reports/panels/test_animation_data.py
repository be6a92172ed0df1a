import base64
import dataclasses
import json
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import Normalize

from reports import panels
from reports.base import style
from reports.figures.shielding.figure import shielding_animation
from reports.study import RigidUnits, StudyResults, rigid_units


def decoded(text: str, dtype: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype)


def clip(motion: np.ndarray) -> panels.AnimationClip:
    n_units = motion.shape[2]
    corner = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
    site = np.zeros((n_units, 2))
    site[:, 0] = 15.0 * np.arange(n_units)
    flags = np.zeros(n_units, int)
    none = np.zeros((0, 2), int)
    structure = RigidUnits(site[:, None] + corner, site, none, none, flags, flags)
    return panels.AnimationClip("Static", "#000000", structure, motion)


def static(motion: np.ndarray) -> dict[str, Any]:
    axis = panels.AnimationAxis(
        "load", "mm", np.linspace(0, 5, motion.shape[1]), 2, False, {"slow": 1.0}
    )
    field = panels.ColourField("uy", "u_y", "mm", 1.0, "signed", (-1.0, 1.0))
    return panels.payload(panels.Animation(axis, ["compression"], [clip(motion)], [field]))


def test_motion_is_right_within_the_stated_error_at_kept_times(study: StudyResults) -> None:
    data = panels.payload(shielding_animation(study))
    shift, turn = panels.animation_data.quantisation_error(data)
    assert shift < 1e-4
    assert turn < 1e-5
    frames = panels.animation_data.kept_frames(401, 2 * 4 * 225 * 3)
    for s in range(2):
        for c in range(4):
            part = data["motion"][s][c]
            levels = decoded(part["data"], "<i2").reshape(len(frames), 225, 3)
            exact = study.response["displacement"].values[s, c][frames]
            error = np.abs(np.array(part["step"]) * levels - exact)
            assert error[..., :2].max() <= 1.001 * shift
            assert error[..., 2].max() <= 1.001 * turn
    values = decoded(data["axis"]["values"], "<f4")
    assert values[0] == 0.0
    assert values[-1] == np.float32(2.0)
    assert (len(values), data["axis"]["shown"], data["axis"]["saved"]) == (201, 201, 401)


@pytest.mark.parametrize("n_frames", [1, 2, 7, 200, 401, 1800])
@pytest.mark.parametrize("n_values", [3, 5400, 60_000, 900_000])
def test_kept_frames_fit_the_page(n_frames: int, n_values: int) -> None:
    frames = panels.animation_data.kept_frames(n_frames, n_values)
    assert frames[0] == 0
    assert frames[-1] == n_frames - 1
    assert len(frames) <= panels.animation_data.MOST_STEPS + 1
    assert len(frames) <= 3 or 2 * n_values * len(frames) <= panels.animation_data.LARGEST_MOTION


def test_lost_units_are_marked_as_such() -> None:
    motion = np.ones((1, 3, 4, 3))
    motion[0, 1, 2] = np.nan
    levels = decoded(static(motion)["motion"][0][0]["data"], "<i2").reshape(3, 4, 3)
    assert (levels[1, 2] == panels.animation_data.NO_DATA).all()
    assert (
        np.delete(levels.reshape(12, 3), 6, axis=0) == panels.animation_data.LARGEST_LEVEL
    ).all()


def test_colours_do_not_magnify_rounding() -> None:
    motion = np.zeros((1, 3, 4, 3))
    motion[..., 0] = 2.5
    motion[..., 1] = 1e-14
    assert panels.signed_field("ux", motion).limits == (-3.0, 3.0)
    assert panels.signed_field("uy", motion).limits == (-3.0, 3.0)  # beside the motion along x
    motion[..., 1] = 1e-4
    assert panels.signed_field("uy", motion).limits == pytest.approx((-1e-4, 1e-4))
    motion[...] = 1e-16
    assert panels.signed_field("uy", motion).limits == (-1.0, 1.0)
    assert panels.signed_field("theta", motion).limits == (-1.0, 1.0)
    assert panels.turn_field(motion).limits == (0.0, 1.0)
    assert panels.size_field(motion, 15.0).limits == (0.0, 1.0)


def test_a_static_study_needs_no_time_and_no_motion_is_exact() -> None:
    data = static(np.zeros((1, 3, 4, 3)))
    assert data["motion"][0][0]["step"] == [0.0, 0.0, 0.0]
    assert panels.animation_data.quantisation_error(data) == (0.0, 0.0)
    assert json.loads(json.dumps(data)) == data
    assert [data["axis"][key] for key in ("name", "unit", "loops")] == ["load", "mm", False]


def test_polygons_are_whole(study: StudyResults) -> None:
    shape = panels.payload(shielding_animation(study))["structures"][1]
    centroid = decoded(shape["centroid"], "<f4").reshape(-1, 2)
    owner = decoded(shape["owner"], "<i4")
    corners = decoded(shape["arm"], "<f4").reshape(-1, 2) + centroid[owner]
    exact = study.response["vertices"].values[1].reshape(-1, 2)
    np.testing.assert_allclose(corners, exact, atol=2e-5)
    ligaments = decoded(shape["ligaments"], "<i4").reshape(-1, 2)
    lengths = np.linalg.norm(np.diff(corners[ligaments], axis=1), axis=2)
    np.testing.assert_allclose(lengths, 2.25, atol=1e-4)


SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
TRIANGLE = np.array([[10.0, 0.0], [13.0, 0.0], [10.0, 3.0], [np.nan, np.nan]])
PAIR = RigidUnits(
    vertices=np.stack([SQUARE, TRIANGLE]),
    site=np.array([[1.0, 1.0], [11.0, 1.0]]),
    ligament_unit=np.array([[0, 1]]),
    ligament_vertex=np.array([[1, 0]]),
    region=np.array([rigid_units.SURROUNDINGS, rigid_units.CLOAK]),
    support=np.array([rigid_units.CLAMPED, rigid_units.FREE]),
)


def test_a_unit_turns_about_its_centroid() -> None:
    displacement = np.array([[0.5, -0.25, np.pi / 2], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(PAIR.centroid, [[1, 1], [11, 1]], atol=1e-12)
    moved = rigid_units.deformed(PAIR, displacement)
    there = [[2.5, -0.25], [2.5, 1.75], [0.5, 1.75], [0.5, -0.25]]
    np.testing.assert_allclose(moved[0], there, atol=1e-12)
    np.testing.assert_array_equal(moved[1], TRIANGLE)


def test_absent_units_are_not_drawn_and_values_follow() -> None:
    vertices = PAIR.vertices.copy()
    vertices[0] = np.nan
    holed = dataclasses.replace(PAIR, vertices=vertices)
    axes = style.place(style.page(50.0), 5, 5, 40, 40)
    shades: dict[str, Any] = {"colour_map": style.MAGNITUDE, "norm": Normalize(0, 2)}
    drawn = panels.draw(axes, holed, values=np.array([1.0, 2.0]), **shades)
    assert len(drawn.get_paths()) == 1
    values = drawn.get_array()
    assert values is not None
    np.testing.assert_array_equal(values, [2.0])
    assert np.shape(drawn.get_paths()[0].vertices) == (4, 2)  # three corners, closed


def test_middle_of_the_top_edge_of_an_even_one_the_left_of_two(study: StudyResults) -> None:
    full = rigid_units.from_dataset(study.design, study.scene.spacing)
    assert rigid_units.middle_of_top_edge(full) == 7 + 15 * 14
    site = np.array([[i, j] for j in range(2) for i in range(4)], float) * 15.0
    empty = np.zeros((8, 0), int)
    plain = RigidUnits(np.zeros((8, 4, 2)), site, empty, empty, np.zeros(8, int), np.zeros(8, int))
    assert rigid_units.middle_of_top_edge(plain) == 5
