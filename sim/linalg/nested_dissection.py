"""Orders the dofs by nested dissection, so that a sparse Cholesky factor fills little.

A network is cut in two along a straight line by the units next to it, and so on; the units of a cut
come after those of both sides. Each cut, and each part too small to be cut, is a front: its dofs
are eliminated together as one dense block, coupled to later dofs, the front's boundary.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.core import Floats, Ints

SMALLEST_PART = 8
"""Units that are no longer cut: smaller fronts cost more in calls than they save in fill."""


MOST_PARALLEL = 2
"""Generations of fronts, from the last one down, whose children may be factorised side by side."""
LEAST_PARALLEL_WORK = 1 << 18
"""Numbers of the factor, of a front and all below it, from which that gains more than it costs."""


class Fronts(NamedTuple):
    """Fronts in the order of elimination. A front's matrix has its own dofs, then its boundary."""

    first: Ints  # (n_fronts + 1,) first own dof, with the end appended
    edge: Ints  # (n_fronts + 1,) where a front's part of ``boundary`` starts
    boundary: Ints  # later dofs that fronts are coupled to, ascending in each front
    # position of each of these in the matrix of the parent, the front that is next to eliminate one
    # of the boundary
    place: Ints
    child: Ints  # (n_fronts + 1,) where a front's part of ``children`` starts
    children: Ints  # fronts by parent
    # (n_fronts,) whether threads may factorise side by side what is below each child: runs of
    # fronts that end with one child after another, with scratch memory of their own
    parallel: Ints
    panel: Ints  # (n_fronts + 1,) where a front's own columns start among the factor's values
    update: Ints  # (n_fronts,) where its boundary's block starts in the scratch memory
    owner: Ints  # (n,) front that eliminates each dof
    scratch: Ints  # (1,) size of the scratch memory


def no_fronts() -> Fronts:
    """Returns the fronts of nothing."""
    start, none = np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    return Fronts(start, start, none, none, start, none, none, start, none, none, start)


def dissect(
    site: Floats, pairs: Ints, n_dofs: Ints
) -> tuple[NDArray[np.int64], list[NDArray[np.int64]], list[NDArray[np.int64]]]:
    """Orders the units that have dofs, and groups them in fronts.

    `site` (n_units, 2) is where they are, `pairs` (n_pairs, 2) are coupled, `n_dofs` (n_units,) are
    free.

    Returns:
        units in order; for each front its own units and its boundary, both as places in the order.
    """
    neighbour = _neighbours(len(site), pairs)
    parts = _cut(np.flatnonzero(n_dofs), site, neighbour)
    order = np.concatenate(parts)
    place = np.full(len(site), -1)
    place[order] = np.arange(len(order))
    ends = np.cumsum([len(part) for part in parts])
    passed: list[list[Ints]] = [[] for _ in parts]
    own, boundaries = [], []
    for part, end, handed in zip(parts, ends, passed, strict=True):
        touched = np.unique(np.concatenate([place[neighbour[part]].ravel(), *handed]))
        boundary = touched[touched >= end]
        if len(boundary):
            passed[np.searchsorted(ends, boundary[0], side="right")].append(boundary)
        own.append(np.arange(end - len(part), end))
        boundaries.append(boundary)
    return order, own, boundaries


def _neighbours(n_units: int, pairs: Ints) -> Ints:
    """Tabulates the coupled units (n_units, most) of each, filled up with the unit itself."""
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    counts = np.bincount(both[:, 0], minlength=n_units)
    table = np.repeat(np.arange(n_units)[:, None], max(1, int(counts.max(initial=0))), axis=1)
    starts = np.cumsum(counts) - counts
    table[both[:, 0], np.arange(len(both)) - np.repeat(starts, counts)] = both[:, 1]
    return table


def _cut(units: Ints, site: Floats, neighbour: Ints) -> list[Ints]:
    """Cuts a set of units into parts in order of elimination, none of them empty."""
    if len(units) <= SMALLEST_PART:
        return [units] if len(units) else []
    here = site[units]
    axis = int(np.argmax(np.ptp(here, axis=0)))
    along = here[:, axis]
    one = along < np.median(along) - 1e-9 * np.ptp(along)
    if not one.any():
        one = np.arange(len(units)) < len(units) // 2
    left, right = units[one], units[~one]
    near_right = np.isin(neighbour[right], left).any(axis=1)
    near_left = np.isin(neighbour[left], right).any(axis=1)
    if near_left.sum() < near_right.sum():
        between, left = left[near_left], left[~near_left]
    else:
        between, right = right[near_right], right[~near_right]
    last = [between] if len(between) else []
    return [*_cut(left, site, neighbour), *_cut(right, site, neighbour), *last]


def fronts_of(own: list[Ints], boundaries: list[Ints], n_dofs: Ints) -> Fronts:
    """Translates fronts from units to dofs, of which each unit has `n_dofs` (n_ordered,).

    A front's own units and its boundary, the later ones that it is coupled to, are places in the
    order of elimination.
    """
    ends = np.concatenate([[0], np.cumsum(n_dofs)])

    def dofs(places: Ints) -> Ints:
        counts = n_dofs[places]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        return np.repeat(ends[places], counts) + within

    first = np.array([ends[part[0]] for part in own] + [ends[-1]])
    rows = [dofs(boundary) for boundary in boundaries]
    owner = np.repeat(np.arange(len(own)), np.diff(first))
    parent = np.array([owner[row[0]] if len(row) else -1 for row in rows])
    place = [
        _place(row, first[up], first[up + 1], rows[up])
        for row, up in zip(rows, parent, strict=True)
    ]
    children = np.argsort(parent, kind="stable")[np.count_nonzero(parent < 0) :]
    n_children = np.bincount(parent[parent >= 0], minlength=len(own))
    heights = np.array([len(row) for row in rows])
    columns = np.diff(first)
    panel = _starts(columns * (columns + heights))
    parallel = _choose_parallel(parent, panel)
    update, scratch = _scratch(heights**2, parent, parallel)
    return Fronts(
        first=first,
        edge=_starts(heights),
        boundary=np.concatenate(rows),
        place=np.concatenate(place),
        child=_starts(n_children),
        children=children,
        parallel=parallel,
        panel=panel,
        update=update,
        owner=owner,
        scratch=np.array([scratch]),
    )


def _starts(counts: Ints) -> Ints:
    return np.concatenate([[0], np.cumsum(counts)])


def _place(row: Ints, first: int, end: int, boundary: Ints) -> Ints:
    """Finds dofs in the matrix of a front with own dofs first..end and that boundary."""
    return np.where(row < end, row - first, end - first + np.searchsorted(boundary, row))


def _choose_parallel(parent: Ints, panel: Ints) -> Ints:
    """Chooses fronts whose children may be factorised side by side, from the last ones down.

    A front that waits for one further up may lie between those below another, where units are
    missing: then there are no runs.
    """
    n = len(parent)
    below: list[list[int]] = [[] for _ in range(n + 1)]  # the last list: those without parent
    lowest = np.arange(n + 1)
    for front, up in enumerate(parent.tolist()):
        below[up].append(front)
        lowest[up] = min(lowest[up], lowest[front])
    in_runs = [
        all(lowest[after] == before + 1 for before, after in pairwise(children))
        for children in below
    ]
    parallel = np.zeros(n, dtype=np.int64)
    latest = below[n] if in_runs[n] else []
    for _ in range(MOST_PARALLEL):
        numbers = ((front, panel[front + 1] - panel[lowest[front]]) for front in latest)
        large = [
            front for front, number in numbers if number >= LEAST_PARALLEL_WORK and in_runs[front]
        ]
        latest = [child for front in large if len(below[front]) > 1 for child in below[front]]
        parallel[parent[latest]] = 1
    return parallel


def _scratch(sizes: Ints, parent: Ints, parallel: Ints) -> tuple[Ints, int]:
    """Places each front's block while it waits for its parent; returns starts and total size.

    Blocks that threads may fill side by side have memory of their own.
    """
    n = len(parent)
    sharing = np.arange(n)  # the last of the fronts that one shares memory with
    for front in range(n - 1, -1, -1):
        up = parent[front] if parent[front] >= 0 else n - 1
        if not (parallel[front] or parallel[up]):
            sharing[front] = sharing[up]
    start, total = np.zeros(n, dtype=np.int64), 0
    for last in np.unique(sharing):
        fronts = np.flatnonzero(sharing == last)
        start[fronts] = total + _stacked(fronts.tolist(), sizes, parent)
        total = int((start + sizes)[fronts].max())
    return start, total


def _stacked(fronts: list[int], sizes: Ints, parent: Ints) -> Ints:
    """Places the blocks of fronts in one memory, each in the first gap that it fits in."""
    start: dict[int, int] = {}
    living: list[int] = []
    for front in fronts:
        at = 0
        for one in sorted(living, key=start.__getitem__):
            if start[one] - at >= sizes[front]:
                break
            at = start[one] + int(sizes[one])
        start[front] = at
        living = [one for one in living if parent[one] != front] + [front]
    return np.array(list(start.values()), dtype=np.int64)
