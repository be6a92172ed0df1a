"""Measures first-order optimality: the residual of the Karush-Kuhn-Tucker conditions."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from sim.core import Floats, Ints
from sim.optimise.qp import reachable, shortest_step

MULTIPLIER = 1e-7
"""Smallest multiplier, relative to the steepest slope, that is not rounding."""


@dataclass(frozen=True)
class Stationarity:
    """Holds the optimality of a design."""

    # largest entry of the step (mm) that takes the design, pushed down the gradient by up to 1 mm,
    # back to its linearised constraints; 0 at an optimum, 1 where nothing is in the way of the
    # steepest slope
    residual: float
    active: Ints  # ids of the constraints that carry a multiplier
    multipliers: Floats  # (n_active,) theirs


def stationarity(
    gradient: Floats,
    values: Floats,
    jacobian: sp.csr_array,
    x: Floats,
    lower: Floats,
    upper: Floats,
    scale: float,
) -> Stationarity:
    """Computes the projected gradient |P(x - gradient / scale) - x|, zero exactly at KKT points.

    P is the projection on the linearised constraints (m,) >= 0, with their Jacobian (m, n), and the
    bounds of the design x (n,). At an optimum its multipliers are those of the problem; elsewhere
    they are estimates. `scale` is a slope that counts as steep, such as the largest entry of the
    first gradient.
    """
    slope = gradient / scale
    rows = reachable(values, jacobian, 2 * float(np.abs(slope).max(initial=0.0)))
    found = shortest_step(-slope, jacobian[rows], -values[rows], lower - x, upper - x)
    if found is None:
        return Stationarity(float(np.abs(slope).max()), rows[:0], np.zeros(0))
    priced = found.multipliers > MULTIPLIER
    multipliers = scale * found.multipliers[priced]
    return Stationarity(float(np.abs(found.step).max(initial=0.0)), rows[priced], multipliers)
