import numpy as np
import pytest
import shapely
from shapely.affinity import rotate, translate

import sim
from sim.structure import clearance, close_pairs, displaced, overlapping_pairs, smallest_gap

LATTICE = sim.quads(4, 3, 15.0, 2.25, np.deg2rad(20))


def all_pairs(lattice: sim.Lattice, vertices: np.ndarray) -> tuple[dict, list]:
    units = [shapely.Polygon(vertices[lattice.unit == unit]) for unit in range(lattice.n_units)]
    pairs = [(a, b) for a in range(len(units)) for b in range(a + 1, len(units))]
    distances = {(a, b): units[a].distance(units[b]) for a, b in pairs}
    return distances, [[a, b] for a, b in pairs if units[a].intersection(units[b]).area > 1e-9]


@pytest.mark.parametrize("seed", range(5))
def test_gap_and_overlaps_agree_with_all_pairs(seed: int) -> None:
    motion = np.random.default_rng(seed).normal(size=(LATTICE.n_units, 3)) * [1.5, 1.5, 0.3]
    vertices = displaced(LATTICE, LATTICE.vertices, motion)
    distances, overlapping = all_pairs(LATTICE, vertices)
    gap = smallest_gap(LATTICE, vertices)
    assert gap.distance == pytest.approx(min(distances.values()), abs=1e-12)
    assert distances[gap.units] == pytest.approx(gap.distance, abs=1e-12)
    assert overlapping_pairs(LATTICE, vertices).tolist() == overlapping


def test_a_history_is_the_sum_of_its_states() -> None:
    motion = np.random.default_rng(1).normal(size=(6, LATTICE.n_units, 3)) * [1.5, 1.5, 0.3]
    motion[0] = 0
    found = clearance(LATTICE, LATTICE.vertices, motion)
    assert (found.overlaps[0], found.gap[0]) == (0, pytest.approx(2.25))
    assert found.overlaps.sum() > 0
    for state in range(6):
        vertices = displaced(LATTICE, LATTICE.vertices, motion[state])
        gap = smallest_gap(LATTICE, vertices)
        assert found.gap[state] == gap.distance
        assert tuple(found.gap_units[state]) == gap.units
        assert found.overlaps[state] == len(overlapping_pairs(LATTICE, vertices))


def test_units_turn_about_their_centroids() -> None:
    vertices = LATTICE.vertices.copy()
    vertices[20:24] += np.array([[2.0, 1.0], [0, 0], [-1.0, 0.5], [0, 0]])
    motion = np.zeros((LATTICE.n_units, 3))
    motion[5] = [0.3, -0.2, 0.4]
    before = shapely.Polygon(vertices[20:24])
    expected = translate(rotate(before, 0.4, before.centroid, use_radians=True), 0.3, -0.2)
    moved = displaced(LATTICE, vertices, motion)
    assert expected.equals_exact(shapely.Polygon(moved[20:24]), 1e-12)
    others = np.delete(np.arange(LATTICE.n_vertices), range(20, 24))
    np.testing.assert_allclose(moved[others], vertices[others])


def test_touching_units_do_not_overlap_crossed_ones_do() -> None:
    lattice = sim.quads(2, 1, 15.0, 2.25, 0.0)
    motion = np.array([[[0.0, 0, 0], [-2.25, 0, 0]], [[0.0, 0, 0], [-2.5, 0, 0]]])
    found = clearance(lattice, lattice.vertices, motion)
    assert found.gap.tolist() == pytest.approx([0.0, 0.0], abs=1e-12)
    assert found.overlaps.tolist() == [0, 1]
    alone = sim.quads(1, 1, 15.0, 2.25, 0.0)
    assert smallest_gap(alone, alone.vertices).distance == np.inf
    vertices = LATTICE.vertices.copy()
    vertices[[20, 21]] = vertices[[21, 20]]
    vertices[24:28] -= [12.0, 0.0]
    assert smallest_gap(LATTICE, vertices).distance == 0.0
    assert [5, 6] in overlapping_pairs(LATTICE, vertices).tolist()


def test_close_pairs_are_the_bonded_and_the_diagonal_neighbours() -> None:
    pairs = {tuple(pair) for pair in close_pairs(LATTICE, LATTICE.vertices, 15.0)}
    steps = {tuple(LATTICE.index[b] - LATTICE.index[a]) for a, b in pairs}
    assert steps == {(1, 0), (0, 1), (1, 1), (-1, 1)}
    assert len(pairs) == 9 + 8 + 12
