from __future__ import annotations

import numpy as np
import pytest

from sim.structure import Lattice, quads
from tests.sim.structures import mixed_polygons, rotating_squares


@pytest.fixture(params=[rotating_squares, mixed_polygons], ids=["squares", "mixed"])
def lattice(request: pytest.FixtureRequest) -> Lattice:
    made: Lattice = request.param()
    return made


def test_ring_neighbours_are_inverse_and_stay_in_their_unit(lattice: Lattice) -> None:
    every = np.arange(lattice.n_vertices)
    np.testing.assert_array_equal(lattice.previous_vertex[lattice.next_vertex], every)
    np.testing.assert_array_equal(lattice.unit[lattice.next_vertex], lattice.unit)


def test_polygons_are_counter_clockwise(lattice: Lattice) -> None:
    here, there = lattice.vertices, lattice.vertices[lattice.next_vertex]
    cross = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    assert (np.bincount(lattice.unit, cross) > 0).all()


def test_ends_of_a_ligament_share_their_group_alone(lattice: Lattice) -> None:
    groups = lattice.group[lattice.ligaments]
    np.testing.assert_array_equal(groups[:, 0], groups[:, 1])
    members = np.bincount(lattice.group)
    assert (members[groups[:, 0]] == 2).all()
    assert np.count_nonzero(members == 1) == lattice.n_vertices - 2 * lattice.n_ligaments
    assert len(members) == lattice.n_groups


def test_padded_puts_every_vertex_in_its_units_row() -> None:
    lattice = mixed_polygons()
    padded = lattice.padded(lattice.vertices)
    assert padded.shape == (8, 6, 2)
    np.testing.assert_array_equal(padded[0], lattice.vertices[:6])
    np.testing.assert_array_equal((~np.isnan(padded[:, :, 0])).sum(axis=1), [6, *[3] * 6, 5])


def test_rectangular_lattice() -> None:
    lattice = quads(4, 3, 10.0, 1.5, 0.3)
    assert (lattice.n_units, lattice.n_ligaments) == (12, 3 * 3 + 4 * 2)
    np.testing.assert_array_equal(lattice.site[5], [10.0, 10.0])
    np.testing.assert_array_equal(lattice.index[7], [3, 1])
    assert np.linalg.norm(lattice.ligament_vectors, axis=1) == pytest.approx(1.5)
    one = quads(1, 1, 10.0, 1.5, 0.3)
    assert (one.n_ligaments, one.n_groups) == (0, 4)
