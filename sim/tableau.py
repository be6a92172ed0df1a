"""Coefficients of the implicit Runge-Kutta method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.arrays import Floats


class Tableau(NamedTuple):
    """A stiffly accurate method with an explicit first stage and one diagonal coefficient.

    Attributes:
        stages: (n_stages, n_stages) coefficients; the last row gives the step's end.
        nodes: (n_stages,) stage times in units of the step.
        error: (n_stages,) weights of the velocity in the embedded error estimate.
        order: of the step.
    """

    stages: Floats
    nodes: Floats
    error: Floats
    order: int


def esdirk3() -> Tableau:
    """ESDIRK3(2)4L[2]SA: L-stable, order 3, stage order 2.

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
