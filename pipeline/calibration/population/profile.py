"""Profiles the likelihood of the population's mean constants, one at a time."""

from __future__ import annotations

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from pipeline.calibration.population.hierarchical_model import (
    PriorNumbers,
    Readings,
    hierarchical_model,
)
from sim.core import Floats

FACTORS = np.geomspace(1 / 3, 5, 13)
"""Of each constant, over its posterior median."""
_FLAT = 1e3
"""Width of a prior that tells nothing, in logarithms."""


def profile_likelihoods(
    readings: Readings, priors: PriorNumbers, medians: Mapping[str, Floats]
) -> Floats:
    """Computes twice the logarithm of the likelihood lost (3, n_factors) as one constant is held.

    The other mean constants and those of all samples are at their best; spreads and errors stay at
    the posterior's medians.
    """
    from numpyro.infer.util import log_density

    flat = priors._replace(constants=_FLAT)
    spread, middle, samples = (medians[name] for name in ("spread", "mean", "constants"))
    held = {name: medians[name] for name in ("spread", "discrepancy", "mounting", "reading")}

    @jax.jit
    @jax.value_and_grad
    def lost(free: Floats, fixed: Floats, which: Floats) -> jax.Array:
        mean = jnp.where(which, fixed, jnp.asarray(free[:3]))
        logs = jnp.reshape(free[3:], samples.shape)
        apart = (logs[:, :1] - mean[0]) / spread[0]
        given = held | {"mean": mean, "apart": apart, "known": logs[:, 1:]}
        return -2 * log_density(hierarchical_model, (readings, flat), {}, given)[0]

    found = np.empty((3, len(FACTORS)))
    best = minimize(
        lost, np.r_[middle, samples.ravel()], (middle, np.zeros(3, bool)), "BFGS", jac=True
    )
    for constant in range(3):
        start = best.x
        for k, factor in enumerate(FACTORS):
            fixed = middle.copy()
            fixed[constant] += np.log(factor)
            end = minimize(lost, start, (fixed, np.arange(3) == constant), "BFGS", jac=True)
            found[constant, k], start = end.fun, end.x
    return found - best.fun
