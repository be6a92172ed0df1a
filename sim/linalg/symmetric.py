"""Stores the tangent, a symmetric matrix, as a band, by panels or by fronts.

All are filled entry by entry, factorised in place and solved with through the same functions.
"""

from typing import Literal, NamedTuple

import numpy as np

from sim.core import Floats, Ints, compiled
from sim.linalg import banded as band
from sim.linalg import lapack  # noqa: F401  (hands its routines over)
from sim.linalg.nested_dissection import Fronts, dissect, fronts_of, no_fronts
from sim.linalg.panels import WIDTH, Panels, no_panels, panels_of, reach_of

NARROW_FLOP, BAND_FLOP, FRONT_FLOP, FRONT_CALL, PANEL_FLOP = 72e-12, 42e-12, 58e-12, 2e-6, 38e-12
"""Seconds of one core for a multiplication of each method, and for a front's calls."""

Storage = Literal["band", "panels", "fronts"]

FASTEST: tuple[Storage, ...] = ("panels", "fronts")
"""Storages to choose from."""
PINNED: tuple[Storage, ...] = ("band", "fronts")
"""Those that designs of equilibria choose from, which are pinned to the last bit: each way to solve
rounds in its own way."""

BY_FRONTS, BY_PANELS = -1, -2


class Pattern(NamedTuple):
    """Describes the layout of the entries."""

    size: Ints  # (2,) number of dofs, and half bandwidth; BY_FRONTS or BY_PANELS if so stored
    fronts: Fronts  # none if stored otherwise
    panels: Panels  # likewise

    @property
    def storage(self) -> Storage:
        """Names the storage."""
        width = self.size[1]
        return "fronts" if width == BY_FRONTS else "panels" if width == BY_PANELS else "band"

    @property
    def n_values(self) -> int:
        """Counts the numbers stored."""
        n, width = self.size
        stored = {
            "fronts": self.fronts.panel[-1],
            "panels": self.panels.first[-1],
            "band": n * (width + 1),
        }
        return int(stored[self.storage])

    @property
    def n_dofs(self) -> int:
        """Returns the size of the matrix."""
        return int(self.size[0])

    def describe(self) -> str:
        """Describes the storage in words."""
        kinds = {
            "fronts": f"{len(self.fronts.update)} fronts of a nested dissection",
            "panels": f"{len(self.panels.first) - 1} panels of four columns",
            "band": f"a band of half width {self.size[1]}",
        }
        return f"{self.n_dofs} dofs, {kinds[self.storage]}, {self.n_values} numbers"


class Matrix(NamedTuple):
    """Holds a symmetric matrix, or its Cholesky factor."""

    values: Floats  # (n_values,) lower half; of a band column by column
    scratch: Floats  # of the factorisation by fronts, or of the solution by panels
    pattern: Pattern  # of the entries
    threads: int = 1  # that factorise it, where it is large and stored by fronts


def number_free_dofs(
    site: Floats, pairs: Ints, held: Ints, storages: tuple[Storage, ...] = PINNED
) -> tuple[Ints, Pattern]:
    """Numbers the dofs that are not held, in the order in which the tangent is solved fastest.

    `site` (n_units, 2) is where the units are, three dofs each; `pairs` (n, 2) are coupled; `held`
    are ids of the prescribed dofs; `storages` are those to choose from.

    Returns:
        (3 n_units,) position of each dof among the free ones, -1 where held; and the pattern.
    """
    first, *others = storages
    made = [_NUMBER[first](site, pairs, held)]
    if seconds(made[0][1]) >= len(site) * FRONT_CALL / 10:  # or no order could gain much
        made += [_NUMBER[storage](site, pairs, held) for storage in others]
    return min(made, key=lambda numbered: seconds(numbered[1]))


def seconds(pattern: Pattern) -> float:
    """Predicts the time of one core to factorise a matrix of that pattern, s."""
    if pattern.storage == "band":
        n, width = (float(number) for number in pattern.size)
        return (NARROW_FLOP if width < band.NARROW else BAND_FLOP) * n * width**2
    if pattern.storage == "panels":
        return float(PANEL_FLOP * (np.diff(pattern.panels.first).astype(float) ** 2 / 4).sum())
    own, edge = (
        np.diff(ends).astype(float) for ends in (pattern.fronts.first, pattern.fronts.edge)
    )
    flops = (own**3 / 3 + own**2 * edge + own * edge**2).sum()
    return float(FRONT_FLOP * flops + FRONT_CALL * len(own))


def _in_a_band(site: Floats, pairs: Ints, held: Ints) -> tuple[Ints, Pattern]:
    free, width = band.number_free_dofs(len(site), pairs, held)
    return free, Pattern(np.array([free.max(initial=-1) + 1, width]), no_fronts(), no_panels())


def _in_panels(site: Floats, pairs: Ints, held: Ints) -> tuple[Ints, Pattern]:
    orders = (np.arange(len(site)), band.cuthill_mckee(len(site), pairs))
    numbered = [band.number_in_order(order, held) for order in orders]
    made = [(free, panels_of(reach_of(free.reshape(-1, 3), pairs))) for free in numbered]
    size = np.array([numbered[0].max(initial=-1) + 1, BY_PANELS])
    patterns = [(free, Pattern(size, no_fronts(), panels)) for free, panels in made]
    return min(patterns, key=lambda numbered: seconds(numbered[1]))


def _in_fronts(site: Floats, pairs: Ints, held: Ints) -> tuple[Ints, Pattern]:
    is_free = np.ones(3 * len(site), dtype=bool)
    is_free[held] = False
    n_dofs = is_free.reshape(-1, 3).sum(axis=1)
    order, own, boundaries = dissect(site, pairs, n_dofs)
    dofs = (3 * order[:, None] + np.arange(3)).ravel()
    dofs = dofs[is_free[dofs]]
    free = np.full(3 * len(site), -1, dtype=np.int64)
    free[dofs] = np.arange(len(dofs))
    fronts = fronts_of(own, boundaries, n_dofs[order])
    return free, Pattern(np.array([len(dofs), BY_FRONTS]), fronts, no_panels())


_NUMBER = {"band": _in_a_band, "panels": _in_panels, "fronts": _in_fronts}


def matrix(pattern: Pattern, threads: int = 1) -> Matrix:
    """Allocates a matrix of that pattern, not yet cleared."""
    n_scratch = pattern.fronts.scratch[0] + WIDTH * (len(pattern.panels.first) - 1)
    return Matrix(np.empty(pattern.n_values), np.empty(n_scratch), pattern, threads)


@compiled
def clear(of: Matrix) -> None:
    """Sets all entries to zero."""


@compiled
def entry(pattern: Pattern, i: int, j: int) -> int:
    """Finds the entries (i, j) and (j, i), which are one, among the values; -1 if one is negative.

    They must be in the pattern.
    """


@compiled
def add(of: Matrix, i: int, j: int, value: float) -> None:
    """Adds to the entries (i, j) and (j, i), which must be in the pattern; to none if negative."""


def block_entries(pattern: Pattern, free: Ints, pairs: Ints) -> Ints:
    """Finds where the lower halves of blocks of six by six lie among the values, row by row.

    ``free`` (3 n_units,) numbers the free dofs, negative where held; ``pairs`` (n, 2) of units are
    coupled by a block each.

    Returns:
        (n, 21) places, -1 where a dof is held.
    """
    found = np.empty((len(pairs), 21), dtype=np.int64)
    _find_blocks(pattern, free, pairs, found)
    return found


@compiled
def _find_blocks(pattern: Pattern, free: Ints, pairs: Ints, found: Ints, n_pairs: int = 0) -> None:
    """Fills what ``block_entries`` returns."""


@compiled
def factorise(of: Matrix) -> bool:
    """Replaces the matrix by its Cholesky factor; False if it is not positive definite."""


@compiled
def solve(factor: Matrix, right: Floats) -> None:
    """Overwrites ``right`` (n,) with the solution for a factor of ``factorise``."""
