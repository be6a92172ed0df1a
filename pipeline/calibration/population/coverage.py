"""Tries the band on simulated sets of samples: how many new curves it holds."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pipeline.calibration.inputs import Sampling
from pipeline.calibration.population.hierarchical_model import (
    PriorNumbers,
    Readings,
    sample_posteriors,
)
from pipeline.calibration.population.prediction import (
    PosedCurve,
    find_band,
    medians,
    new_curves,
    redraw_population,
    student_band,
)
from sim.core import Floats

NEW_CURVES = 100
"""For every set."""


class Coverage(NamedTuple):
    """Holds of every simulated set (n_sets,) the part of new curves inside, and relative widths.

    Attributes:
        inside: part of the new curves that lie inside as a whole.
        width: of the band, over that of Student's interval of the same samples.
    """

    inside: Floats
    width: Floats


def try_band(
    readings: Readings,
    priors: PriorNumbers,
    curve: PosedCurve,
    truth: Mapping[str, Floats],
    effort: Sampling,
    seed: int = 1,
) -> Coverage:
    """Simulates sets of samples from a known population, and fits each as if it were measured.

    Args:
        readings: the design: which samples are read in which test, and where.
        priors: of the fit.
        curve: that is predicted.
        truth: mean, spread (3,), discrepancy (), mounting and reading (n_kinds,).
        effort: how many sets, and how long each is sampled.
        seed: of all.
    """
    random, n_sets = np.random.default_rng(seed), effort.simulated_sets
    n_samples = readings.shares.shape[-1]
    logs = truth["mean"] + truth["spread"] * random.normal(size=(n_sets, n_samples, 3))
    scales = (truth["discrepancy"], truth["mounting"], truth["reading"])
    roots = np.linalg.cholesky(readings.covariance(*scales))
    noise = np.einsum("tnm,stm->stn", roots, random.normal(size=(n_sets, *readings.used.shape)))
    made = np.array([readings.expected(each) for each in logs]) + noise
    alike = np.broadcast_to
    found = sample_posteriors(
        readings._replace(log_force=made, used=alike(readings.used, made.shape)),
        PriorNumbers(*(alike(each, (n_sets, *np.shape(each))) for each in priors)),
        warm_up=effort.simulated_draws,
        draws=effort.simulated_draws,
        seed=seed,
    )
    same = {name: np.asarray(value)[None] for name, value in truth.items()}
    new = new_curves(curve, same | {"constants": logs[:1]}, random, repeats=NEW_CURVES * n_sets)
    inside, width = np.empty(n_sets), np.empty(n_sets)
    for k, curves in enumerate(new.reshape(n_sets, NEW_CURVES, -1)):
        draws = {name: values[k] for name, values in found.items()}
        known = redraw_population(draws, priors, random)
        band = find_band(new_curves(curve, known, random))
        inside[k] = band.holds(curves).mean()
        width[k] = band.half_width / student_band(curve, medians(draws)["constants"]).half_width
    return Coverage(inside, width)
