"""Stores the tangent, a symmetric matrix, as a band or by fronts, whichever is solved faster.

Both are filled entry by entry, factorised in place and solved with through the same functions.
"""

from typing import NamedTuple

import numpy as np

from sim.core import Floats, Ints, compiled
from sim.linalg import banded as band
from sim.linalg.multifrontal import entry, factorise_fronts, solve_fronts
from sim.linalg.nested_dissection import Fronts, dissect, fronts_of, no_fronts

NARROW_FLOP, BAND_FLOP, FRONT_FLOP, FRONT_CALL = 72e-12, 42e-12, 58e-12, 2e-6
"""Seconds of one core for a multiplication of each method, and for a front's calls."""


class Pattern(NamedTuple):
    """Layout of the entries."""

    size: Ints  # (2,) number of dofs, and half bandwidth; the latter is -1 if stored by fronts
    fronts: Fronts  # none if stored as a band

    @property
    def by_fronts(self) -> bool:
        """Tells storage by fronts from a band."""
        return bool(self.size[1] < 0)

    @property
    def n_values(self) -> int:
        """Counts the numbers stored."""
        n, width = self.size
        return int(self.fronts.panel[-1]) if self.by_fronts else int(n * (width + 1))

    @property
    def n_dofs(self) -> int:
        """Returns the size of the matrix."""
        return int(self.size[0])

    def describe(self) -> str:
        """Describes the storage in words."""
        if self.by_fronts:
            kind = f"{len(self.fronts.update)} fronts of a nested dissection"
        else:
            kind = f"a band of half width {self.size[1]}"
        return f"{self.n_dofs} dofs, {kind}, {self.n_values} numbers"


class Matrix(NamedTuple):
    """A symmetric matrix, or its Cholesky factor."""

    values: Floats  # (n_values,) lower half; of a band column by column
    scratch: Floats  # of the factorisation
    pattern: Pattern  # of the entries


def number_free_dofs(
    site: Floats, pairs: Ints, held: Ints, by_fronts: bool | None = None
) -> tuple[Ints, Pattern]:
    """Numbers the dofs that are not held, in the order in which the tangent is solved fastest.

    `site` (n_units, 2) is where the units are, three dofs each; `pairs` (n, 2) are coupled; `held`
    are ids of the prescribed dofs; `by_fronts` tells how to store the tangent, by default whichever
    should be faster.

    Returns:
        (3 n_units,) position of each dof among the free ones, -1 where held; and the pattern.
    """
    if by_fronts is not None:
        return (_in_fronts if by_fronts else _in_a_band)(site, pairs, held)
    banded = _in_a_band(site, pairs, held)
    if seconds(banded[1]) < len(site) * FRONT_CALL / 10:  # no order could gain much
        return banded
    return min(banded, _in_fronts(site, pairs, held), key=lambda made: seconds(made[1]))


def seconds(pattern: Pattern) -> float:
    """Predicts the time of one core to factorise a matrix of that pattern, s."""
    if not pattern.by_fronts:
        n, width = (float(number) for number in pattern.size)
        return (NARROW_FLOP if width < band.NARROW else BAND_FLOP) * n * width**2
    own, edge = (
        np.diff(ends).astype(float) for ends in (pattern.fronts.first, pattern.fronts.edge)
    )
    flops = (own**3 / 3 + own**2 * edge + own * edge**2).sum()
    return float(FRONT_FLOP * flops + FRONT_CALL * len(own))


def _in_a_band(site: Floats, pairs: Ints, held: Ints) -> tuple[Ints, Pattern]:
    free, width = band.number_free_dofs(len(site), pairs, held)
    return free, Pattern(np.array([free.max(initial=-1) + 1, width]), no_fronts())


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
    return free, Pattern(np.array([len(dofs), -1]), fronts)


def matrix(pattern: Pattern) -> Matrix:
    """Allocates a matrix of that pattern, not yet cleared."""
    n, width = pattern.size
    n_values = pattern.fronts.panel[-1] if width < 0 else n * (width + 1)
    return Matrix(np.empty(n_values), np.empty(pattern.fronts.scratch[0]), pattern)


@compiled
def clear(of: Matrix) -> None:
    """Sets all entries to zero."""
    of.values[:] = 0.0


@compiled
def add(of: Matrix, i: int, j: int, value: float) -> None:
    """Adds to the entries (i, j) and (j, i), which must be in the pattern; to none if negative."""
    if i < 0 or j < 0:
        return
    row, column = max(i, j), min(i, j)
    width = of.pattern.size[1]
    if width < 0:
        f = of.pattern.fronts
        at = entry(row, column, f.owner, f.first, f.edge, f.boundary, f.panel)
        of.values[at] += value
    else:
        of.values[column * width + row] += value


@compiled
def factorise(of: Matrix) -> bool:
    """Replaces the matrix by its Cholesky factor; False if it is not positive definite."""
    n, width = of.pattern.size
    if width < 0:
        return factorise_fronts(of.values, of.scratch, of.pattern.fronts)
    return band.factorise(of.values.reshape(n, width + 1))


@compiled
def solve(factor: Matrix, right: Floats) -> None:
    """Overwrites ``right`` (n,) with the solution for a factor of ``factorise``."""
    n, width = factor.pattern.size
    if width < 0:
        solve_fronts(factor.values, factor.pattern.fronts, right)
    else:
        band.solve(factor.values.reshape(n, width + 1), right)
