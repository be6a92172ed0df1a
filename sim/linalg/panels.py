"""Cholesky factor by panels of four columns, each as long as its columns reach (a skyline).

Ordered by reverse Cuthill-McKee, the columns of a lattice of n by n units reach as far as a
diagonal of it is long, on average half as far as in a band of rows, and a factor takes half as many
products. A panel's rows are four numbers: a vector register.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.core import Floats, Ints, compiled, inlined
from sim.linalg.row_products import WIDTH, add_row_product


class Panels(NamedTuple):
    """Panels in the order of elimination, row by row from their diagonal block on."""

    first: Ints  # (n_panels + 1,) where the values of each start, with the end appended


def no_panels() -> Panels:
    """Returns the panels of nothing."""
    return Panels(np.zeros(1, dtype=np.int64))


def panels_of(reach: Ints) -> Panels:
    """Lays out the panels of columns whose last entries are in the rows ``reach`` (n,).

    A panel reaches as far as any column before its end, and to the end of a panel.
    """
    n_panels = -(-len(reach) // WIDTH)
    padded = np.concatenate([reach, np.arange(len(reach), WIDTH * n_panels)])
    last = np.maximum.accumulate(padded)[WIDTH - 1 :: WIDTH]
    rows = WIDTH * (last // WIDTH + 1 - np.arange(n_panels))
    return Panels(np.concatenate([[0], np.cumsum(WIDTH * rows)]).astype(np.int64))


def reach_of(free: Ints, unit_pairs: Ints) -> NDArray[np.int64]:
    """Finds the last row (n,) that each column of the tangent has an entry in.

    `free` (n_units, 3) numbers the free dofs, negative where held; `unit_pairs` (n, 2) are coupled.
    """
    reach = np.arange(int(free.max(initial=-1)) + 1)
    coupled = np.concatenate([free[unit_pairs].reshape(len(unit_pairs), 6), np.tile(free, 2)])
    last = np.broadcast_to(coupled.max(axis=1)[:, None], coupled.shape)
    np.maximum.at(reach, coupled[coupled >= 0], last[coupled >= 0])
    return reach


@inlined
def entry_of_panels(row: int, column: int, first: Ints) -> int:
    """Finds the entry (row >= column) among the values; its dofs must be coupled."""
    panel = column // WIDTH
    return first[panel] + WIDTH * (row - WIDTH * panel) + column % WIDTH


@compiled
def fill_padding(values: Floats, n_dofs: int, first: Ints) -> None:
    """Puts ones on the diagonal after the last column, up to the end of the last panel."""
    for column in range(n_dofs, WIDTH * (len(first) - 1)):
        values[entry_of_panels(column, column, first)] = 1.0


@inlined
def _factorise_block(v: Floats, at: int) -> bool:
    """Factorises a diagonal block in place; False if it is not positive definite."""
    pivot = v[at]
    if not pivot > 0.0:
        return False
    l00 = np.sqrt(pivot)
    l10, l20, l30 = v[at + 4] / l00, v[at + 8] / l00, v[at + 12] / l00
    pivot = v[at + 5] - l10 * l10
    if not pivot > 0.0:
        return False
    l11 = np.sqrt(pivot)
    l21, l31 = (v[at + 9] - l20 * l10) / l11, (v[at + 13] - l30 * l10) / l11
    pivot = v[at + 10] - l20 * l20 - l21 * l21
    if not pivot > 0.0:
        return False
    l22 = np.sqrt(pivot)
    l32 = (v[at + 14] - l30 * l20 - l31 * l21) / l22
    pivot = v[at + 15] - l30 * l30 - l31 * l31 - l32 * l32
    if not pivot > 0.0:
        return False
    v[at], v[at + 4], v[at + 5], v[at + 8], v[at + 9] = l00, l10, l11, l20, l21
    v[at + 10], v[at + 12], v[at + 13], v[at + 14] = l22, l30, l31, l32
    v[at + 15] = np.sqrt(pivot)
    return True


@inlined
def _inverse_transposed(v: Floats, at: int) -> tuple[float, ...]:
    """Inverts a factorised diagonal block; its transpose, rows first."""
    d0, d1, d2, d3 = 1.0 / v[at], 1.0 / v[at + 5], 1.0 / v[at + 10], 1.0 / v[at + 15]
    m10 = -v[at + 4] * d0 * d1
    m21 = -v[at + 9] * d1 * d2
    m32 = -v[at + 14] * d2 * d3
    m20 = -(v[at + 8] * d0 + v[at + 9] * m10) * d2
    m31 = -(v[at + 13] * d1 + v[at + 14] * m21) * d3
    m30 = -(v[at + 12] * d0 + v[at + 13] * m10 + v[at + 14] * m20) * d3
    return (d0, m10, m20, m30, 0.0, d1, m21, m31, 0.0, 0.0, d2, m32, 0.0, 0.0, 0.0, d3)


@compiled
def factorise_panels(v: Floats, first: Ints) -> bool:
    """Replaces the matrix in the values ``v`` by its factor; False if not positive definite."""
    for panel in range(len(first) - 1):
        at = first[panel]
        if not _factorise_block(v, at):
            return False
        inverse = _inverse_transposed(v, at)
        end = first[panel + 1]
        for row in range(at + 16, end, 4):
            add_row_product(v, row, 0.0, row, inverse)
        for b in range(at + 16, end, 16):  # four rows that are the columns of a later panel
            minus_transposed = (
                -v[b], -v[b + 4], -v[b + 8], -v[b + 12],
                -v[b + 1], -v[b + 5], -v[b + 9], -v[b + 13],
                -v[b + 2], -v[b + 6], -v[b + 10], -v[b + 14],
                -v[b + 3], -v[b + 7], -v[b + 11], -v[b + 15],
            )  # fmt: skip
            shift = first[panel + (b - at) // 16] - b
            for row in range(b, end, 4):
                add_row_product(v, row + shift, 1.0, row, minus_transposed)
    return True


@compiled
def solve_panels(v: Floats, first: Ints, right: Floats, scratch: Floats) -> None:
    """Overwrites ``right`` (n,) with the solution for a factor in ``v``.

    ``scratch`` has room for four numbers a panel.
    """
    n = len(right)
    x = scratch
    x[:n] = right
    x[n:] = 0.0
    for panel in range(len(first) - 1):
        rows, j = v[first[panel] : first[panel + 1]], WIDTH * panel
        x0 = x[j] / rows[0]
        x1 = (x[j + 1] - rows[4] * x0) / rows[5]
        x2 = (x[j + 2] - rows[8] * x0 - rows[9] * x1) / rows[10]
        x3 = (x[j + 3] - rows[12] * x0 - rows[13] * x1 - rows[14] * x2) / rows[15]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3
        below = x[j : j + len(rows) // 4]
        for i in range(4, len(below)):
            below[i] -= (rows[4 * i] * x0 + rows[4 * i + 1] * x1) + (
                rows[4 * i + 2] * x2 + rows[4 * i + 3] * x3
            )
    for panel in range(len(first) - 2, -1, -1):
        rows, j = v[first[panel] : first[panel + 1]], WIDTH * panel
        below = x[j : j + len(rows) // 4]
        x0, x1, x2, x3 = below[0], below[1], below[2], below[3]
        for i in range(4, len(below)):
            known = below[i]
            x0 -= rows[4 * i] * known
            x1 -= rows[4 * i + 1] * known
            x2 -= rows[4 * i + 2] * known
            x3 -= rows[4 * i + 3] * known
        x3 /= rows[15]
        x2 = (x2 - rows[14] * x3) / rows[10]
        x1 = (x1 - rows[9] * x2 - rows[13] * x3) / rows[5]
        x0 = (x0 - rows[4] * x1 - rows[8] * x2 - rows[12] * x3) / rows[0]
        x[j], x[j + 1], x[j + 2], x[j + 3] = x0, x1, x2, x3
    right[:] = x[:n]
