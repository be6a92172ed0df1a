import dataclasses
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import Normalize

from reports.base import style
from reports.panels import draw
from reports.study import RigidUnits, StudyResults, rigid_units

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
TRIANGLE = np.array([[10.0, 0.0], [13.0, 0.0], [10.0, 3.0], [np.nan, np.nan]])


@pytest.fixture
def pair() -> RigidUnits:
    return RigidUnits(
        vertices=np.stack([SQUARE, TRIANGLE]),
        site=np.array([[1.0, 1.0], [11.0, 1.0]]),
        ligament_unit=np.array([[0, 1]]),
        ligament_vertex=np.array([[1, 0]]),
        region=np.array([rigid_units.SURROUNDINGS, rigid_units.CLOAK]),
        support=np.array([rigid_units.CLAMPED, rigid_units.FREE]),
    )


def test_a_unit_turns_about_its_centroid(pair: RigidUnits) -> None:
    displacement = np.array([[0.5, -0.25, np.pi / 2], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(pair.centroid, [[1, 1], [11, 1]], atol=1e-12)
    moved = rigid_units.deformed(pair, displacement)
    there = [[2.5, -0.25], [2.5, 1.75], [0.5, 1.75], [0.5, -0.25]]
    np.testing.assert_allclose(moved[0], there, atol=1e-12)
    np.testing.assert_array_equal(moved[1], TRIANGLE)


def test_absent_units_are_not_drawn_and_values_follow(pair: RigidUnits) -> None:
    vertices = pair.vertices.copy()
    vertices[0] = np.nan
    holed = dataclasses.replace(pair, vertices=vertices)
    axes = style.place(style.page(50.0), 5, 5, 40, 40)
    shades: dict[str, Any] = {"colour_map": style.MAGNITUDE, "norm": Normalize(0, 2)}
    drawn = draw(axes, holed, values=np.array([1.0, 2.0]), **shades)
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
