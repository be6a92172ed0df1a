"""Holds coefficients of the time integrators: splittings and the Runge-Kutta method."""

from typing import NamedTuple

import numpy as np

from sim.core import Floats


class Splitting(NamedTuple):
    """Holds a symmetric composition that starts and ends with a drift."""

    drifts: Floats  # (n_kicks + 1,) coefficients
    kicks: Floats  # (n_kicks,) coefficients
    order: int  # of accuracy
    stability: float  # largest h omega of an undamped oscillator


LEAPFROG = Splitting(np.array([0.5, 0.5]), np.array([1.0]), 2, 2.0)


def blanes_moan() -> Splitting:
    """Returns order 4 by six kicks (Blanes & Moan, J. Comput. Appl. Math. 142, 2002)."""
    a1, a2, a3 = 0.0792036964311957, 0.353172906049774, -0.0420650803577195
    b1, b2 = 0.209515106613362, -0.143851773179818
    drifts = [a1, a2, a3, 1 - 2 * (a1 + a2 + a3), a3, a2, a1]
    b3 = 0.5 - b1 - b2
    kicks = np.array([b1, b2, b3, b3, b2, b1])
    return Splitting(np.array(drifts), kicks, 4, _stability(np.array(drifts), kicks))


def _stability(drifts: Floats, kicks: Floats) -> float:
    """Finds the smallest h omega at which the map of an oscillator stops being a rotation."""
    for z in np.arange(0.01, 2.0 * len(kicks) + 0.01, 0.01):
        step = np.array([[1.0, drifts[0]], [0.0, 1.0]])
        for drift, kick in zip(drifts[1:], kicks, strict=True):
            step = np.array([[1.0, drift], [0.0, 1.0]]) @ [[1.0, 0.0], [-kick * z * z, 1.0]] @ step
        if abs(np.trace(step)) > 2.0 + 1e-9:
            return float(z)
    return 2.0 * len(kicks)


BLANES_MOAN = blanes_moan()


class Tableau(NamedTuple):
    """Holds a stiffly accurate method with an explicit first stage and one diagonal coefficient."""

    stages: Floats  # (n_stages, n_stages) coefficients; the last row gives the step's end
    nodes: Floats  # (n_stages,) stage times in units of the step
    error: Floats  # (n_stages,) weights of the velocity in the embedded error estimate
    order: int  # of the step


def esdirk3() -> Tableau:
    """Returns ESDIRK3(2)4L[2]SA: L-stable, order 3, stage order 2.

    Kennedy & Carpenter, NASA/TM-2016-219173; the coefficients follow from its order conditions with
    c3 = 3/5. The embedded solution of order 2 uses the first two stages.
    """
    gamma = 0.43586652150845899941601945
    c2, c3 = 2 * gamma, 0.6
    a32 = c3 * (c3 - 2 * gamma) / (2 * c2)
    moments = np.array([[c2, c3], [c2**2, c3**2]])
    b2, b3 = np.linalg.solve(moments, [1 / 2 - gamma, 1 / 3 - gamma])
    b1 = 1 - b2 - b3 - gamma
    stages = np.array(
        [
            [0, 0, 0, 0],
            [gamma, gamma, 0, 0],
            [c3 - a32 - gamma, a32, gamma, 0],
            [b1, b2, b3, gamma],
        ]
    )
    embedded = np.array([1 - 1 / (2 * c2), 1 / (2 * c2), 0, 0])
    return Tableau(stages, np.array([0, c2, c3, 1.0]), stages[3] - embedded, 3)


ESDIRK3 = esdirk3()
