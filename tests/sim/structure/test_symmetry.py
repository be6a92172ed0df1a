from __future__ import annotations

import numpy as np

from sim.structure import QUARTER_TURN, design_space, equal_directions, is_invariant, unit_image
from tests.sim.structures import mixed_polygons, rotating_squares

LATTICE = rotating_squares()


def test_quarter_turn_of_rotating_squares() -> None:
    image = unit_image(LATTICE, LATTICE.vertices, QUARTER_TURN, tolerance=1e-9)
    assert image is not None
    np.testing.assert_array_equal(image[[0, 4, 24, 20, 12]], [4, 24, 20, 0, 12])
    assert is_invariant(image, np.array([0, 4, 20, 24]), np.array([12]))
    assert not is_invariant(image, np.array([0, 4, 20]))


def test_a_design_without_the_symmetry_has_no_image() -> None:
    space = design_space(LATTICE, np.array([6, 7]))
    turned = np.asarray(space.vertices(0.01 * np.ones(space.n_variables)))
    assert unit_image(LATTICE, turned, QUARTER_TURN, tolerance=1e-9) is None
    assert unit_image(LATTICE, turned, QUARTER_TURN, tolerance=0.1) is not None


def test_a_mirror_of_turned_squares_changes_them() -> None:
    assert unit_image(LATTICE, LATTICE.vertices, np.diag([-1.0, 1.0]), tolerance=1e-9) is None


def test_mixed_polygons_have_no_quarter_turn() -> None:
    lattice = mixed_polygons()
    assert unit_image(lattice, lattice.vertices, QUARTER_TURN, tolerance=1e-9) is None


def test_directions_a_quarter_turn_apart_are_one_case() -> None:
    directions = np.deg2rad([0.0, 45.0, 90.0, 135.0, 180.0, 10.0])
    one = np.zeros(6, dtype=int)
    np.testing.assert_array_equal(equal_directions(directions, one), [0, 1, 0, 1, 0, 5])
    two = np.array([0, 0, 1, 0, 1, 0])
    np.testing.assert_array_equal(equal_directions(directions, two), [0, 1, 2, 1, 2, 5])
