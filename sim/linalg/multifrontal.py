"""Sparse Cholesky factor by fronts (multifrontal method), in compiled code.

A front's own columns lie in the factor's values, column by column, diagonal block first. What a
front leaves to its boundary is added to its parent (I. S. Duff, J. K. Reid 1983).
"""

import numpy as np

from sim.core import Floats, Ints, compiled
from sim.linalg.lapack import dgemv, dpotrf, dsyrk, dtrsm, dtrsv
from sim.linalg.nested_dissection import Fronts


@compiled
def entry_of_fronts(
    row: int, column: int, owner: Ints, firsts: Ints, edge: Ints, boundary: Ints, panel: Ints
) -> int:
    """Finds the entry (row >= column) among the factor's values; its dofs must be coupled.

    It takes the arrays of ``Fronts`` one by one: passing a tuple of them costs more
    than the search.
    """
    front = owner[column]
    first, end = firsts[front], firsts[front + 1]
    low, high = edge[front], edge[front + 1]
    start = panel[front] + (column - first) * (end - first + high - low)
    if row < end:
        return start + row - first
    here = low
    while low < high:
        middle = (low + high) // 2
        if boundary[middle] < row:
            low = middle + 1
        else:
            high = middle
    return start + end - first + low - here


@compiled
def factorise_fronts(values: Floats, scratch: Floats, fronts: Fronts) -> bool:
    """Factorises the matrix in ``values`` in place; False if it is not positive definite."""
    text = np.array([ord("L"), ord("R"), ord("T"), ord("N")], dtype=np.uint8)
    lower, right, transposed, plain = text[0:1], text[1:2], text[2:3], text[3:4]
    numbers, size = np.array([1.0, -1.0]), np.zeros(4, dtype=np.int32)
    own, rest, whole, info = size[0:1], size[1:2], size[2:3], size[3:4]
    plus, minus = numbers[0:1], numbers[1:2]
    for front in range(len(fronts.update)):
        k = fronts.first[front + 1] - fronts.first[front]
        b = fronts.edge[front + 1] - fronts.edge[front]
        panel = values[fronts.panel[front] : fronts.panel[front + 1]]
        block = scratch[fronts.update[front] : fronts.update[front] + b * b]
        block[:] = 0.0
        for c in range(fronts.child[front], fronts.child[front + 1]):
            _add_child(fronts.children[c], k, b, panel, block, scratch, fronts)
        own[0], rest[0], whole[0] = k, b, k + b
        dpotrf(lower.ctypes, own.ctypes, panel.ctypes, whole.ctypes, info.ctypes)
        if info[0] != 0 or not np.isfinite(panel[(k - 1) * (k + b) + k - 1]):  # NaN spreads there
            return False
        if b == 0:
            continue
        below = panel[k:]
        dtrsm(
            right.ctypes, lower.ctypes, transposed.ctypes, plain.ctypes, rest.ctypes, own.ctypes,
            plus.ctypes, panel.ctypes, whole.ctypes, below.ctypes, whole.ctypes,
        )  # fmt: skip
        dsyrk(
            lower.ctypes, plain.ctypes, rest.ctypes, own.ctypes, minus.ctypes, below.ctypes,
            whole.ctypes, plus.ctypes, block.ctypes, rest.ctypes,
        )  # fmt: skip
    return True


@compiled
def _add_child(
    child: int, k: int, b: int, panel: Floats, block: Floats, scratch: Floats, fronts: Fronts
) -> None:
    """Adds what a child left to the matrix of its parent: own columns, then the boundary's."""
    place = fronts.place[fronts.edge[child] : fronts.edge[child + 1]]
    n = len(place)
    left = scratch[fronts.update[child] : fronts.update[child] + n * n]
    for j in range(n):
        source = left[j * n : (j + 1) * n]
        if place[j] < k:
            target = panel[place[j] * (k + b) : (place[j] + 1) * (k + b)]
            for i in range(j, n):
                target[place[i]] += source[i]
        else:
            target = block[(place[j] - k) * b : (place[j] - k + 1) * b]
            for i in range(j, n):
                target[place[i] - k] += source[i]


@compiled
def solve_fronts(values: Floats, fronts: Fronts, right: Floats) -> None:
    """Overwrites ``right`` (n,) with the solution for a factor of ``factorise_fronts``."""
    text = np.array([ord("L"), ord("T"), ord("N")], dtype=np.uint8)
    lower, transposed, plain = text[0:1], text[1:2], text[2:3]
    numbers, size = np.array([1.0, -1.0, 0.0]), np.array([0, 0, 0, 1], dtype=np.int32)
    own, rest, whole, unit = size[0:1], size[1:2], size[2:3], size[3:4]
    plus, minus, none = numbers[0:1], numbers[1:2], numbers[2:3]
    n_fronts = len(fronts.update)
    gathered = np.empty(len(right))
    for turn in range(2 * n_fronts):
        down = turn < n_fronts
        front = turn if down else 2 * n_fronts - 1 - turn
        first, end = fronts.first[front], fronts.first[front + 1]
        rows = fronts.boundary[fronts.edge[front] : fronts.edge[front + 1]]
        panel = values[fronts.panel[front] : fronts.panel[front + 1]]
        below, x = panel[end - first :], right[first:end]
        own[0], rest[0], whole[0] = end - first, len(rows), end - first + len(rows)
        if down:
            dtrsv(
                lower.ctypes, plain.ctypes, plain.ctypes, own.ctypes, panel.ctypes, whole.ctypes,
                x.ctypes, unit.ctypes,
            )  # fmt: skip
            if len(rows):
                dgemv(
                    plain.ctypes, rest.ctypes, own.ctypes, plus.ctypes, below.ctypes,
                    whole.ctypes, x.ctypes, unit.ctypes, none.ctypes, gathered.ctypes,
                    unit.ctypes,
                )  # fmt: skip
            for i in range(len(rows)):
                right[rows[i]] -= gathered[i]
        else:
            for i in range(len(rows)):
                gathered[i] = right[rows[i]]
            if len(rows):
                dgemv(
                    transposed.ctypes, rest.ctypes, own.ctypes, minus.ctypes, below.ctypes,
                    whole.ctypes, gathered.ctypes, unit.ctypes, plus.ctypes, x.ctypes,
                    unit.ctypes,
                )  # fmt: skip
            dtrsv(
                lower.ctypes, transposed.ctypes, plain.ctypes, own.ctypes, panel.ctypes,
                whole.ctypes, x.ctypes, unit.ctypes,
            )  # fmt: skip
