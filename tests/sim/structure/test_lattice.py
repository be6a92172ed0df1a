import numpy as np
import pytest

from sim.structure import Lattice, honeycomb, listed, overlapping_pairs, quads, triangular
from tests.sim.structures import mixed_polygons, rotating_squares


@pytest.fixture(params=[rotating_squares, mixed_polygons], ids=["squares", "mixed"])
def lattice(request: pytest.FixtureRequest) -> Lattice:
    made: Lattice = request.param()
    return made


def test_rings_stay_in_their_unit_and_run_counter_clockwise(lattice: Lattice) -> None:
    every = np.arange(lattice.n_vertices)
    np.testing.assert_array_equal(lattice.previous_vertex[lattice.next_vertex], every)
    np.testing.assert_array_equal(lattice.unit[lattice.next_vertex], lattice.unit)
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


@pytest.mark.parametrize(
    ("named", "joined", "n_ligaments"),
    [
        (honeycomb(6, 5, 10.0, 1.5, 0.3), 3, 5 * 5 + 6 * 4 // 2),
        (honeycomb(6, 5, 10.0, 1.5), 3, 5 * 5 + 6 * 4 // 2),
        (triangular(6, 5, 10.0, 1.5), 6, 5 * 5 + 4 * (2 * 6 - 1)),
    ],
    ids=["rotating", "honeycomb", "triangular"],
)
def test_regular_units_face_each_neighbour(named: Lattice, joined: int, n_ligaments: int) -> None:
    """Ligaments lie between corners that face each other, on the lines between the sites."""
    assert (named.n_units, named.n_ligaments) == (30, n_ligaments)
    one, other = named.ligament_units.T
    along = (named.site[other] - named.site[one]) / 10.0
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1.0)
    np.testing.assert_allclose(named.ligament_vectors, 1.5 * along, atol=1e-12)
    inner = np.bincount(named.ligament_units.ravel()) == joined
    assert inner.any()
    assert len(np.unique(named.ligaments)) == 2 * n_ligaments
    assert len(overlapping_pairs(named, named.vertices)) == 0
    np.testing.assert_allclose(named.index @ [1, 6], np.arange(30))


def test_rectangular_lattice() -> None:
    lattice = quads(4, 3, 10.0, 1.5, 0.3)
    assert (lattice.n_units, lattice.n_ligaments) == (12, 3 * 3 + 4 * 2)
    np.testing.assert_array_equal(lattice.site[5], [10.0, 10.0])
    np.testing.assert_array_equal(lattice.index[7], [3, 1])
    assert np.linalg.norm(lattice.ligament_vectors, axis=1) == pytest.approx(1.5)
    one = quads(1, 1, 10.0, 1.5, 0.3)
    assert (one.n_ligaments, one.n_groups) == (0, 4)


def test_listed_polygons_may_be_drawn_either_way_round() -> None:
    square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
    for drawn in (square, square[::-1]):
        x, y = listed([drawn], [], 2.0).vertices.T
        assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2 == 4.0
    with pytest.raises(ValueError, match="a polygon of 0 corners has no area"):
        listed([()], [], 15.0)
