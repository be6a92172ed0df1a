"""Tests which slots and edges of a unit are kept apart."""

import numpy as np
import pytest

from sim.constraints.slot_walls import slot_pairs, slot_walls, slots
from sim.structure import Lattice
from tests.sim.structures import mixed_polygons, rotating_squares

LATTICES = pytest.mark.parametrize("lattice", [rotating_squares(4), mixed_polygons()])


@LATTICES
def test_slots_of_a_unit_are_paired_in_their_order(lattice: Lattice) -> None:
    every = slots(lattice).tolist()
    of = lattice.unit[slots(lattice)[:, 1]]
    wanted = [
        [*every[one], *every[other]]
        for one in range(len(every))
        for other in range(one + 1, len(every))
        if of[one] == of[other]
    ]
    np.testing.assert_array_equal(slot_pairs(lattice), wanted)


@LATTICES
def test_slots_have_walls_to_the_edges_that_do_not_end_there(lattice: Lattice) -> None:
    wanted = [
        [*slot, edge, lattice.next_vertex[edge]]
        for slot in slots(lattice).tolist()
        for edge in range(lattice.n_vertices)
        if lattice.unit[edge] == lattice.unit[slot[1]] and edge not in slot[1:3]
    ]
    np.testing.assert_array_equal(slot_walls(lattice), wanted)


def test_the_places_of_a_large_lattice_take_little_memory() -> None:
    """In proportion to its units: all pairs of its slots would take 100 GB."""
    lattice = rotating_squares(200)
    assert len(slot_pairs(lattice)) == 6 * 198**2 + 3 * 4 * 198 + 4
    assert len(slot_walls(lattice)) == 2 * len(slots(lattice))
