"""First-order optimality: how far a design is from satisfying the Karush-Kuhn-Tucker conditions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from sim.lattice import Floats, Ints
from sim.optimise.qp import shortest_step

ACTIVE = 1e-4
"""A constraint (mm) or bound nearer than this to its limit may carry a multiplier."""


@dataclass(frozen=True)
class Stationarity:
    """Optimality of a design.

    Attributes:
        residual: largest entry of the steepest admissible descent, relative to ``scale``; 0 at an
            optimum.
        active: ids of the constraints at their limits.
        multipliers: (n_active,) their least-squares multipliers, >= 0.
    """

    residual: float
    active: Ints
    multipliers: Floats


def stationarity(
    gradient: Floats,
    values: Floats,
    jacobian: sp.csr_array,
    x: Floats,
    lower: Floats,
    upper: Floats,
    scale: float,
) -> Stationarity:
    """Projects the steepest descent on the cone of admissible directions.

    Its length is the KKT residual min |gradient - jacobian^T multipliers| over multipliers >= 0 of
    the active constraints and bounds (Moreau decomposition).

    Args:
        gradient: (n,) of the loss.
        values: (m,) of the constraints.
        jacobian: (m, n) of the constraints.
        x: (n,) the design.
        lower: (n,) bounds.
        upper: (n,) bounds.
        scale: slope that counts as steep, such as the largest entry of the first gradient.
    """
    active = np.flatnonzero(values <= ACTIVE)
    free_down = np.where(x - lower > ACTIVE, -np.inf, 0.0)
    free_up = np.where(upper - x > ACTIVE, np.inf, 0.0)
    found = shortest_step(
        -gradient / scale, jacobian[active], np.zeros(len(active)), free_down, free_up
    )
    if found is None:
        steepest = float(np.abs(gradient).max()) / scale
        return Stationarity(steepest, active, np.zeros(len(active)))
    return Stationarity(float(np.abs(found.step).max()), active, scale * found.multipliers)
