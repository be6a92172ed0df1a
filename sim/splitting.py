"""Coefficients of the explicit methods: alternating drifts and kicks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.arrays import Floats


class Splitting(NamedTuple):
    """A symmetric composition that starts and ends with a drift.

    Attributes:
        drifts: (n_kicks + 1,) coefficients.
        kicks: (n_kicks,) coefficients.
        order: of accuracy.
        stability: largest h omega of an undamped oscillator.
    """

    drifts: Floats
    kicks: Floats
    order: int
    stability: float


LEAPFROG = Splitting(np.array([0.5, 0.5]), np.array([1.0]), 2, 2.0)


def blanes_moan() -> Splitting:
    """Order 4, six kicks, small errors (Blanes & Moan, J. Comput. Appl. Math. 142, 2002)."""
    a1, a2, a3 = 0.0792036964311957, 0.353172906049774, -0.0420650803577195
    b1, b2 = 0.209515106613362, -0.143851773179818
    drifts = [a1, a2, a3, 1 - 2 * (a1 + a2 + a3), a3, a2, a1]
    b3 = 0.5 - b1 - b2
    kicks = np.array([b1, b2, b3, b3, b2, b1])
    return Splitting(np.array(drifts), kicks, 4, _stability(np.array(drifts), kicks))


def _stability(drifts: Floats, kicks: Floats) -> float:
    """Smallest h omega at which the map of an oscillator stops being a rotation."""
    for z in np.arange(0.01, 2.0 * len(kicks) + 0.01, 0.01):
        step = np.array([[1.0, drifts[0]], [0.0, 1.0]])
        for drift, kick in zip(drifts[1:], kicks, strict=True):
            step = np.array([[1.0, drift], [0.0, 1.0]]) @ [[1.0, 0.0], [-kick * z * z, 1.0]] @ step
        if abs(np.trace(step)) > 2.0 + 1e-9:
            return float(z)
    return 2.0 * len(kicks)


BLANES_MOAN = blanes_moan()
