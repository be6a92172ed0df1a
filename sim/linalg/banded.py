"""Orders the dofs for a small bandwidth."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import reverse_cuthill_mckee

from sim.core import Ints

NARROW = 100
"""Columns of a band up to which the own factorisation beats LAPACK's."""


def number_free_dofs(n_units: int, unit_pairs: Ints, held: Ints) -> tuple[NDArray[np.int64], int]:
    """Numbers the dofs that are not held so that the tangent's band is narrow.

    Units have three dofs each; `unit_pairs` (n, 2) are coupled; `held` are ids of the prescribed
    dofs.

    Returns:
        (3 n_units,) position of each dof among the free ones, -1 where held; and the half
        bandwidth.
    """
    order = min(
        (np.arange(n_units), cuthill_mckee(n_units, unit_pairs)),
        key=lambda units: _unit_bandwidth(units, unit_pairs),
    )
    free = number_in_order(order, held)
    return free, _bandwidth(free, unit_pairs)


def number_in_order(order: Ints, held: Ints) -> NDArray[np.int64]:
    """Numbers the dofs (3 n_units,) that are not held, three a unit, in an order of the units."""
    is_free = np.ones(3 * len(order), dtype=bool)
    is_free[held] = False
    dofs = (3 * order[:, None] + np.arange(3)).ravel()
    dofs = dofs[is_free[dofs]]
    free = np.full(3 * len(order), -1, dtype=np.int64)
    free[dofs] = np.arange(len(dofs))
    return free


def cuthill_mckee(n_units: int, unit_pairs: Ints) -> Ints:
    """Orders units by the reverse Cuthill-McKee method."""
    graph = sp.csr_matrix(
        (np.ones(len(unit_pairs)), (unit_pairs[:, 0], unit_pairs[:, 1])), shape=(n_units, n_units)
    )
    return reverse_cuthill_mckee(graph + graph.T, symmetric_mode=True).astype(np.int64)


def _unit_bandwidth(order: Ints, unit_pairs: Ints) -> int:
    place = np.argsort(order)
    return int(np.abs(place[unit_pairs[:, 0]] - place[unit_pairs[:, 1]]).max(initial=0))


def _bandwidth(free: Ints, unit_pairs: Ints) -> int:
    dofs = free.reshape(-1, 3)[unit_pairs].reshape(len(unit_pairs), 6)
    highest = np.where(dofs < 0, -1, dofs).max(axis=1)
    lowest = np.where(dofs < 0, np.iinfo(np.int64).max, dofs).min(axis=1)
    used = highest >= 0
    return max(2, int((highest - lowest)[used].max(initial=0)))
