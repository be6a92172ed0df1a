"""Samples what is known of several samples' constants, and of the population that they are from.

With k_s the logarithms of the constants of sample s, and y the logarithm of a force at the relative
displacement u of a test of kind t,

    k_s ~ N(mean, spread^2),
    y = f_t(k_s, u) + d_t(u) + m_ts(u) + e,

d is the model's discrepancy, alike for all samples, and m what a mounting changes: Gaussian
processes; e is the error of a reading. A mean over samples is the logarithm of their mean force.
The processes are integrated out, so that each kind of test has one normal law. Everything is an
array of one shape, so that many sets of readings are sampled side by side, compiled once.
"""

from collections.abc import Mapping
from functools import partial
from time import sleep
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
from jax import Array
from numpyro.distributions import LogNormal, MultivariateNormal, Normal
from numpyro.infer import NUTS, init_to_median
from numpyro.infer.util import log_density
from scipy.optimize import minimize

from pipeline.calibration.inputs import Priors
from pipeline.calibration.population.curve_emulator import log_force
from sim.core import Floats, Numbers

CORRELATION_LENGTH = 0.5
"""Of the Gaussian processes, over the range of a test's displacements."""
MAX_TREE_DEPTH = 7
"""Doublings of a trajectory of the sampler, at most."""
PAUSE = 0.05
"""Seconds between two looks at a sampler that runs."""
_JITTER = 1e-8

Draws = Mapping[str, Floats]
"""Posterior draws (n_sets, n, ...) by name."""


class Readings(NamedTuple):
    """Holds the readings of all kinds of test, each filled up to as many as any has."""

    used: Numbers  # (n_kinds, n) one for what the fit is to see, zero for the rest
    log_force: Numbers  # (n_kinds, n) of forces in N
    shares: Numbers  # (n_kinds, n, n_samples) of each sample in the mean that was read
    place: Numbers  # (n_kinds, n) displacement over the largest one
    base: Numbers  # (n_kinds, n) logarithm of the displacement in mm
    weights: Numbers  # (n_kinds, n, ...) of the emulator
    ratios: Numbers  # (2,) its centre

    def of_samples(self, logs: Numbers) -> Array:
        """Predicts (n_kinds, n_samples, n) logarithms of forces at the constants (n_samples, 3)."""
        each = jax.vmap(log_force, in_axes=(0, None, 0, None))
        return each(self.weights, self.ratios, self.base, logs)

    def expected(self, logs: Numbers) -> Array:
        """Predicts (n_kinds, n) logarithms of what was read."""
        forces = jnp.exp(self.of_samples(logs))
        return jnp.log(jnp.einsum("tns,tsn->tn", self.shares, forces))

    def covariance(self, discrepancy: Numbers, mounting: Numbers, reading: Numbers) -> Array:
        """Computes (n_kinds, n, n) of what is added; the last two scales are by kind."""
        common = jnp.einsum("tns,tms->tnm", self.shares, self.shares)
        alike = jax.vmap(correlation)(self.place)
        own = common * jnp.eye(alike.shape[-1])
        mounted = jnp.square(mounting)[:, None, None] * common * alike
        read = jnp.square(reading)[:, None, None] * own
        whole = jnp.square(discrepancy) * alike + mounted + read
        seen = self.used[:, :, None] * self.used[:, None, :]
        return (
            jnp.asarray(seen * whole)
            + jnp.eye(alike.shape[-1]) * (1 - self.used + _JITTER)[:, :, None]
        )


def correlation(place: Numbers) -> Array:
    """Correlates (n, n) the values of a Gaussian process: exp(-(u - u')^2 / 2 l^2)."""
    at = jnp.asarray(place)
    return jnp.exp(-(((at[:, None] - at) / CORRELATION_LENGTH) ** 2) / 2)


class PriorNumbers(NamedTuple):
    """Holds the priors as logarithms: centres (3,) of the constants, medians, and widths."""

    centre: Numbers
    constants: Numbers
    medians: Numbers
    wide: Numbers


def prior_numbers(priors: Priors, centre: Floats) -> PriorNumbers:
    """Takes logarithms: of the spread, the discrepancy, the mounting and the reading."""
    medians = [priors.spread, priors.discrepancy, priors.mounting, priors.reading]
    return PriorNumbers(
        centre, np.log(priors.constants), np.log(medians), np.asarray(np.log(priors.wide))
    )


def hierarchical_model(readings: Readings, priors: PriorNumbers) -> None:
    """States the model in NumPyro's terms."""
    n_kinds, _, n_samples = jnp.shape(readings.shares)
    each, medians = jnp.zeros(n_kinds), jnp.asarray(priors.medians)
    mean = numpyro.sample("mean", Normal(priors.centre, priors.constants).to_event(1))
    spread = numpyro.sample("spread", LogNormal(jnp.zeros(3) + medians[0], priors.wide).to_event(1))
    # The axial constant is hardly known of any sample, the others are: each has the form in which
    # the posterior is easy to walk through (Betancourt and Girolami 2015).
    apart = numpyro.sample("apart", Normal(jnp.zeros((n_samples, 1)), 1.0).to_event(2))
    known = numpyro.sample(
        "known", Normal(jnp.tile(mean[1:], (n_samples, 1)), spread[1:]).to_event(2)
    )
    logs = jnp.concatenate([mean[:1] + spread[:1] * apart, known], axis=1)
    numpyro.deterministic("constants", logs)
    discrepancy = numpyro.sample("discrepancy", LogNormal(medians[1], priors.wide))
    mounting = numpyro.sample("mounting", LogNormal(each + medians[2], priors.wide).to_event(1))
    reading = numpyro.sample("reading", LogNormal(each + medians[3], priors.wide).to_event(1))
    covariance = readings.covariance(discrepancy, mounting, reading)
    law = MultivariateNormal(
        readings.expected(logs) * readings.used, covariance_matrix=covariance
    ).to_event(1)
    numpyro.sample("log_force", law, obs=readings.log_force * readings.used)


def sample_posteriors(
    readings: Readings, priors: PriorNumbers, *, warm_up: int, draws: int, seed: int = 0
) -> Draws:
    """Draws from the posteriors of many sets of readings by the no-U-turn sampler, side by side.

    Args:
        readings: with `used` and `log_force` (n_sets, n_kinds, n).
        priors: of every set, each number (n_sets, ...).
        warm_up: steps that are not kept.
        draws: that are.
        seed: of all.

    Returns:
        mean, spread (n_sets, draws, 3), constants (n_sets, draws, n_samples, 3), discrepancy
        (n_sets, draws), mounting and reading (n_sets, draws, n_kinds), diverging (n_sets, draws).
    """
    run = jax.jit(partial(_run_chains, warm_up=warm_up, draws=draws))
    found = run(readings, priors, jax.random.split(jax.random.PRNGKey(seed), len(readings.used)))
    while not all(values.is_ready() for values in found.values()):
        sleep(PAUSE)  # a wait within JAX would let no Ctrl-C in
    return {name: np.asarray(values) for name, values in found.items()}


def _run_chains(
    readings: Readings, priors: PriorNumbers, keys: Array, *, warm_up: int, draws: int
) -> dict[str, Array]:
    of_set = Readings(0, 0, None, None, None, None, None)  # type: ignore[arg-type]

    def walk(seen: Readings, given: PriorNumbers, key: Array) -> dict[str, Array]:
        kernel = NUTS(
            hierarchical_model,
            target_accept_prob=0.9,
            dense_mass=True,
            max_tree_depth=MAX_TREE_DEPTH,
            init_strategy=init_to_median(num_samples=5),
        )
        state = kernel.init(key, warm_up, None, (seen, given), {})
        constrain = kernel.postprocess_fn((seen, given), {})

        def step(at: object, _: None) -> tuple[object, dict[str, Array]]:
            after = kernel.sample(at, (seen, given), {})
            return after, constrain(after.z) | {"diverging": after.diverging}

        state = jax.lax.fori_loop(0, warm_up, lambda _, at: step(at, None)[0], state)
        return jax.lax.scan(step, state, length=draws)[1]

    return jax.vmap(walk, in_axes=(of_set, 0, 0))(readings, priors, keys)


FACTORS = np.geomspace(1 / 4, 4, 21)
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
    flat = priors._replace(constants=np.asarray(_FLAT))
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
