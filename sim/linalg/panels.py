"""Lays out a Cholesky factor by panels of four columns, each as long as these reach (a skyline).

Ordered by reverse Cuthill-McKee, the columns of a lattice of n by n units reach as far as a
diagonal of it is long, on average half as far as in a band of rows, and a factor takes half as many
products. A panel's rows are four numbers: a vector register.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.core import Ints

WIDTH = 4
"""Columns of a panel."""


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
