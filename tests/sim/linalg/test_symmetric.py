"""All ways to store the tangent solve the same systems and notice what is not positive."""

import numpy as np
import pytest
import scipy.sparse as sp

from sim.core import Floats, Ints
from sim.linalg import (
    FASTEST,
    PINNED,
    Matrix,
    Pattern,
    Storage,
    add,
    banded,
    block_entries,
    clear,
    factorise,
    matrix,
    nested_dissection,
    number_free_dofs,
    solve,
)
from sim.linalg.nested_dissection import Fronts, no_fronts
from sim.linalg.panels import no_panels
from sim.linalg.symmetric import seconds
from tests.sim.structures import dense, mixed_polygons, rotating_squares

STORAGES: tuple[Storage, ...] = ("band", "panels", "fronts")
HELD = np.array([0, 1, 2, 9, 13])


def networks() -> dict[str, tuple[Floats, Ints]]:
    """Sites and coupled pairs: of ligaments alone, with diagonal pairs, of polygons, in pieces."""
    squares, mixed = rotating_squares(9), mixed_polygons()
    bonded = squares.ligament_units
    corner = np.array([k for k in range(72) if k % 9 < 8])
    diagonal = np.stack([corner, corner + 10], axis=1)
    separate = bonded[(bonded != 40).all(axis=1) & (bonded // 9 != 6).all(axis=1)]
    return {
        "squares": (squares.site, bonded),
        "diagonals": (squares.site, np.concatenate([bonded, diagonal])),
        "polygons": (mixed.site, mixed.ligament_units),
        "pieces": (squares.site, separate),
    }


def filled(name: str, storage: Storage, diagonal: float = 30.0) -> Matrix:
    """A random symmetric matrix on a network's pattern."""
    site, pairs = networks()[name]
    free, pattern = number_free_dofs(site, pairs, HELD, (storage,))
    made, rng = matrix(pattern), np.random.default_rng(0)
    clear(made)
    for a, b in pairs:
        for i in 3 * a + np.arange(3):
            for j in 3 * b + np.arange(3):
                add(made, free[i], free[j], rng.normal())
    for i in free[free >= 0]:
        add(made, i, i, diagonal)
    return made


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("name", list(networks()))
def test_solution(name: str, storage: Storage) -> None:
    made = filled(name, storage)
    full, right = dense(made), np.random.default_rng(1).normal(size=made.pattern.n_dofs)
    solution = right.copy()
    assert factorise(made)
    solve(made, solution)
    np.testing.assert_allclose(full @ solution, right, atol=1e-12)


@pytest.mark.parametrize("storage", STORAGES)
def test_an_indefinite_matrix_is_noticed(storage: Storage) -> None:
    made = filled("squares", storage, diagonal=4.0)
    assert np.linalg.eigvalsh(dense(made)).min() < 0
    assert not factorise(made)


@pytest.mark.parametrize("place", [0, 100, -1])
@pytest.mark.parametrize("storage", STORAGES)
def test_nan_is_not_positive_definite(storage: Storage, place: int) -> None:
    made = filled("squares", storage)
    n = made.pattern.n_dofs
    add(made, place % n, place % n, np.nan)
    assert not factorise(made)


def parents(fronts: Fronts) -> Ints:
    """Front that each one's block is added to, -1 where there is none."""
    found = np.full(len(fronts.update), -1)
    found[fronts.children] = np.repeat(np.arange(len(found)), np.diff(fronts.child))
    return found


@pytest.fixture
def parallel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets threads share matrices that are far too small for that."""
    monkeypatch.setattr(nested_dissection, "LEAST_PARALLEL_WORK", 1)


@pytest.mark.usefixtures("parallel")
@pytest.mark.parametrize("name", ["squares", "diagonals", "pieces"])
def test_threads_factorise_to_the_same_bits(name: str) -> None:
    made = filled(name, "fronts")
    alone, shared = made._replace(values=made.values.copy()), made._replace(threads=3)
    assert made.pattern.fronts.parallel.any()
    assert factorise(alone)
    assert factorise(shared)
    np.testing.assert_array_equal(shared.values, alone.values)


@pytest.mark.usefixtures("parallel")
@pytest.mark.parametrize("place", [0, 60, 120, -1])
def test_what_one_thread_finds_indefinite_is_not_factorised(place: int) -> None:
    made = filled("squares", "fronts")._replace(threads=4)
    at = place % made.pattern.n_dofs
    add(made, at, at, -1e3)
    assert not factorise(made)


@pytest.mark.usefixtures("parallel")
@pytest.mark.parametrize("seed", range(10))
def test_what_threads_share_has_runs_and_memory_of_its_own(seed: int) -> None:
    """Also where units are missing, so that a part may not be next to the cut that made it."""
    site, pairs = porous(seed)
    fronts = number_free_dofs(site, pairs, np.zeros(0, dtype=int), ("fronts",))[1].fronts
    n, up = len(fronts.update), parents(fronts)
    ends, sizes = fronts.update + np.diff(fronts.edge) ** 2, np.diff(fronts.edge)
    assert fronts.parallel.any() or seed > 2
    side_by_side = [(0, n - 1)]
    for split in np.flatnonzero(fronts.parallel)[::-1].tolist():
        first, last = next(run for run in side_by_side if run[1] == split)
        children = fronts.children[fronts.child[split] : fronts.child[split + 1]].tolist()
        firsts = [first, *(child + 1 for child in children)]
        side_by_side.remove((first, last))
        side_by_side += zip(firsts, [*children, split], strict=True)
    for first, last in side_by_side:
        run = range(first, last + 1)
        assert all(up[k] in run or k == last or up[k] < 0 for k in run)
        for front in (k for k in run if sizes[k]):
            waiting = [k for k in range(n) if k not in run or k < front <= up[k]]
            separate = (ends[waiting] <= fronts.update[front]) | (
                fronts.update[waiting] >= ends[front]
            )
            assert (separate | (sizes[waiting] == 0)).all()


def porous(seed: int) -> tuple[Floats, Ints]:
    """Sites and pairs of a connected lattice from which the more units are missing, the later."""
    there = np.random.default_rng(seed).random((23, 15)) < 1.0 - 0.02 * seed
    number = np.cumsum(there).reshape(there.shape) - 1
    rows, columns = there[1:] & there[:-1], there[:, 1:] & there[:, :-1]
    one = np.concatenate([number[:-1][rows], number[:, :-1][columns]])
    other = np.concatenate([number[1:][rows], number[:, 1:][columns]])
    graph = sp.coo_array((np.ones(len(one)), (one, other)), shape=(there.sum(),) * 2)
    _, piece = sp.csgraph.connected_components(graph)
    kept = piece == np.bincount(piece).argmax()
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    pairs = np.stack([number[one], number[other]], axis=1)
    return np.argwhere(there)[kept].astype(float), pairs[(pairs >= 0).all(axis=1)]


@pytest.mark.parametrize("width", [20, 120])
@pytest.mark.parametrize("place", [(0, 0), (80, 3), (80, 20), (149, 0)])
def test_nan_in_a_band_of_any_width_is_noticed(width: int, place: tuple[int, int]) -> None:
    band = np.zeros((150, width + 1))
    band[:, 0], band[:, 1] = 10.0, -1.0
    pattern = Pattern(np.array([150, width]), no_fronts(), no_panels())
    assert factorise(Matrix(band.copy(), np.empty(0), pattern))
    band[place] = np.nan
    assert not factorise(Matrix(band, np.empty(0), pattern))


@pytest.mark.parametrize("storage", STORAGES)
def test_every_dof_is_numbered_once(storage: Storage) -> None:
    for site, pairs in networks().values():
        free, pattern = number_free_dofs(site, pairs, HELD, (storage,))
        assert (free[HELD] == -1).all()
        np.testing.assert_array_equal(np.sort(free[free >= 0]), np.arange(pattern.n_dofs))
        if storage == "band":
            places = np.where(free < 0, np.nan, free).reshape(-1, 3)[pairs].reshape(len(pairs), 6)
            separate = np.nanmax(places, axis=1) - np.nanmin(places, axis=1)
            assert separate.max() <= pattern.size[1]


@pytest.mark.parametrize(
    ("storages", "wanted"),
    [(PINNED, ["band", "fronts"]), (FASTEST, ["panels", "fronts"])],
    ids=["pinned", "fastest"],
)
def test_fronts_are_chosen_where_they_are_faster(
    storages: tuple[Storage, ...], wanted: list[Storage]
) -> None:
    kinds = []
    for side in (6, 60):
        lattice = rotating_squares(side)
        options = [
            number_free_dofs(lattice.site, lattice.ligament_units, HELD, (storage,))[1]
            for storage in storages
        ]
        chosen = number_free_dofs(lattice.site, lattice.ligament_units, HELD, storages)[1]
        assert seconds(chosen) == min(map(seconds, options))
        kinds.append(chosen.storage)
    assert kinds == wanted


def test_panels_along_diagonals_are_shorter_than_a_band_of_rows() -> None:
    lattice = rotating_squares(15)
    band, panels = (
        number_free_dofs(lattice.site, lattice.ligament_units, HELD, (storage,))[1]
        for storage in ("band", "panels")
    )
    assert panels.n_values < 0.8 * band.n_values
    assert seconds(panels) < 0.6 * seconds(band)


def test_blocks_are_added_where_their_entries_lie() -> None:
    """Whatever the storage, the places of a block are those that `add` finds one by one."""
    lattice = rotating_squares(4)
    for storage in STORAGES:
        free, pattern = number_free_dofs(lattice.site, lattice.ligament_units, HELD, (storage,))
        one_by_one, at_once = matrix(pattern), matrix(pattern)
        clear(one_by_one)
        clear(at_once)
        places = block_entries(pattern, free, lattice.ligament_units)
        for k, (a, b) in enumerate(lattice.ligament_units):
            dofs = np.concatenate([3 * a + np.arange(3), 3 * b + np.arange(3)])
            for m, (row, column) in enumerate(zip(*np.tril_indices(6), strict=True)):
                add(one_by_one, free[dofs[row]], free[dofs[column]], 100.0 * k + m)
                if places[k, m] >= 0:
                    at_once.values[places[k, m]] += 100.0 * k + m
        np.testing.assert_array_equal(at_once.values, one_by_one.values)


def test_a_long_strip_is_numbered_along_its_short_side() -> None:
    pairs = [(k, k + 20) for k in range(60)] + [(k, k + 1) for k in range(80) if k % 20 < 19]
    _, width = banded.number_free_dofs(80, np.array(pairs), np.array([], dtype=int))
    assert width <= 3 * 6
