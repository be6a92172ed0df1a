"""Fits a population of samples, predicts another sample's test, and judges the prediction."""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from numpyro.diagnostics import gelman_rubin

from pipeline.calibration.inputs import ELASTIC_NAMES, Constants, Population, TestKind
from pipeline.calibration.population.curve_emulator import (
    CurveEmulator,
    emulate,
    log_force,
    share_beyond,
)
from pipeline.calibration.population.hierarchical_model import (
    FACTORS,
    Draws,
    PriorNumbers,
    Readings,
    prior_numbers,
    profile_likelihoods,
    sample_posteriors,
)
from pipeline.calibration.population.missing_physics import (
    FittedSlopes,
    RankedMechanism,
    follow_test,
    rank_mechanisms,
)
from pipeline.calibration.population.prediction import (
    PosedCurve,
    PredictionBand,
    find_band,
    medians,
    new_curves,
    pose_curve,
    redraw_population,
    simulate_coverage,
    student_band,
)
from pipeline.calibration.population.sample_readings import (
    SampleCurve,
    check_forces,
    ends,
    read_curve,
    stack_readings,
)
from pipeline.problem.fields import csv_columns, units
from pipeline.runtime import UserError
from sim.core import Floats, Numbers

LOG = logging.getLogger(__name__)

BEYOND = (
    "%.3g %% of the draws of %s have ratios of stiffness beyond the simulated ones, at whose bounds"
    " their forces stay: give material values nearer to the samples', or narrower priors"
)
"""Warning of a share of draws, and of what they are."""
POINTS = 18
"""Of the prediction, evenly spaced."""
QUANTILES = (0.025, 0.5, 0.975)
_REPEATS = 8
"""Curves of a known sample for every draw from the posterior."""


class FittedPopulation(NamedTuple):
    """Holds what a study has found."""

    asked: Population  # for what
    curves: Sequence[SampleCurve]  # as read
    emulators: Mapping[TestKind, CurveEmulator]  # by kind of test; `predicted`: other specimen
    predicted: CurveEmulator
    readings: Readings  # as fitted, and the curve that each is of
    names: Sequence[Sequence[str]]
    posteriors: Mapping[str, Draws]  # draws by what was left out of the fit, "" for nothing


def validate_population(asked: Population, folder: Path) -> xr.Dataset:
    """Fits, predicts and judges; files are as seen from the folder.

    Raises:
        UserError: a file cannot be used.
        SimulationError: a specimen cannot be simulated.
    """
    random = np.random.default_rng(0)
    begin = Constants(asked.material, None, asked.spacing)
    measured = read_curve(asked.predict, asked.predict.lattice, folder)
    shown, end = measured.ascending(POINTS), float(measured.displacement.max())
    at = np.linspace(shown.displacement[0], shown.displacement[-1], POINTS)
    force = np.interp(at, shown.displacement, shown.force)
    check_forces(asked.predict, folder, at, force)
    curves, emulators = _emulate_curves(asked, folder, begin)
    predicted = emulate(asked.predict.lattice, asked.predict.test, begin, end)
    readings, names = stack_readings(curves, emulators, asked.samples, asked.points)
    posteriors = _sample_fits(asked, begin.logs(ELASTIC_NAMES), readings, names)
    found = FittedPopulation(asked, curves, emulators, predicted, readings, names, posteriors)
    kinds = list(emulators)
    curve = pose_curve(predicted, at, kinds.index(asked.predict.test))
    middle, centre = medians(posteriors[""]), begin.logs(ELASTIC_NAMES)
    bands: dict[str, PredictionBand] = {"student": student_band(curve, middle["constants"])}
    drawn: dict[str, Draws] = {}
    for name, given in (("", asked.priors), ("doubled", asked.priors.doubled)):
        drawn[name] = redraw_population(posteriors[name], prior_numbers(given, centre), random)
        bands[name] = find_band(new_curves(curve, drawn[name], random))
    truth = np.log(force)
    ranked = _rank_mechanisms(found, begin, curve, truth - bands[""].median)
    priors = prior_numbers(asked.priors, centre)
    covered = simulate_coverage(readings, priors, curve, middle, asked.sampling)
    variables = {
        **_constant_variables(found),
        "emulator_beyond": ((), share_beyond(predicted.centre, posteriors[""]["constants"])),
        "emulator_beyond_predicted": ((), share_beyond(predicted.centre, _new_samples(drawn[""]))),
        **_prediction_variables(found, curve, bands, truth, folder),
        **_mechanism_variables(ranked),
        **_leave_one_out(found, random),
        **_point_variables(found),
        "covered": ("simulated_set", covered.inside),
        "relative_width": ("simulated_set", covered.width),
        "factor": ("factor", FACTORS),
        "profile": (("constant", "factor"), profile_likelihoods(readings, priors, middle)),
    }
    labels = {
        "constant": list(ELASTIC_NAMES),
        "with_constant": list(ELASTIC_NAMES),
        "sample": list(asked.samples),
        "test": kinds,
        "quantile": list(QUANTILES),
    }
    return xr.Dataset(variables, labels)


def draw_constants(asked: Population, folder: Path, count: int) -> Floats:
    """Draws constants (count, 3) of new samples from the posterior of the whole fit.

    They are in N/mm and N mm/rad, in the order of `ELASTIC_NAMES`.

    Raises:
        UserError: a file cannot be used, or more draws are asked for than there are.
        SimulationError: a specimen cannot be simulated.
    """
    most = asked.sampling.chains * asked.sampling.draws
    if not 1 <= count <= most:
        what, remedy = f"only {most} draws are made", "ask for fewer, or raise sampling.draws"
        if count < 1:
            what, remedy = "no constants are drawn", "ask for one or more"
        raise UserError(what, key="count", value=count, remedy=remedy)
    begin = Constants(asked.material, None, asked.spacing)
    curves, emulators = _emulate_curves(asked, folder, begin)
    readings, _ = stack_readings(curves, emulators, asked.samples, asked.points)
    priors = prior_numbers(asked.priors, begin.logs(ELASTIC_NAMES))
    chains = asked.sampling.chains
    lanes = PriorNumbers(*(np.stack([part] * chains) for part in priors))
    used = np.stack([readings.used] * chains)
    log_force = np.broadcast_to(readings.log_force, used.shape)
    seen = readings._replace(used=used, log_force=log_force)
    effort = asked.sampling
    draws = sample_posteriors(seen, lanes, warm_up=effort.warm_up, draws=effort.draws)
    if beyond := share_beyond(readings.ratios, draws["constants"]):
        LOG.warning(BEYOND, 100 * beyond, "the samples' constants")
    flat = {name: draws[name].reshape(-1, 3) for name in ("mean", "spread")}
    chosen = np.linspace(0, len(flat["mean"]) - 1, count).round().astype(int)
    return np.exp(_new_samples({name: each[chosen] for name, each in flat.items()}))


def _new_samples(draws: Draws) -> Floats:
    """Draws logarithms (n, 3) of the constants of new samples, one of each draw (n, 3)."""
    random = np.random.default_rng(0)
    return np.asarray(draws["mean"] + draws["spread"] * random.normal(size=draws["mean"].shape))


def _emulate_curves(
    asked: Population, folder: Path, begin: Constants
) -> tuple[list[SampleCurve], dict[TestKind, CurveEmulator]]:
    curves = [read_curve(each, asked.lattice, folder) for each in asked.data]
    reach = ends(curves)
    for each, curve in zip(asked.data, curves, strict=True):
        thin = curve.thinned(reach[curve.test], asked.points)
        check_forces(each, folder, thin.displacement, thin.force)
    return curves, {kind: emulate(asked.lattice, kind, begin, far) for kind, far in reach.items()}


def _sample_fits(
    asked: Population, centre: Floats, readings: Readings, names: Sequence[Sequence[str]]
) -> dict[str, Draws]:
    """Samples at once the posteriors of everything, with doubled priors, with parts left out."""
    effort = asked.sampling
    masks: dict[str, Numbers] = {"": readings.used, "doubled": readings.used}
    for k in range(readings.shares.shape[2]):
        masks[asked.samples[k]] = readings.used * (readings.shares[:, :, k] == 0)
    for k, row in enumerate(names):
        masks[row[0].split("_")[0]] = readings.used * (np.arange(len(names)) != k)[:, None]
    given = {name: asked.priors.doubled if name == "doubled" else asked.priors for name in masks}
    lanes = [name for name in masks for _ in range(effort.chains)]
    each = [prior_numbers(given[name], centre) for name in lanes]
    priors = PriorNumbers(*(np.stack(part) for part in zip(*each, strict=True)))
    used = np.stack([masks[name] for name in lanes])
    seen = readings._replace(used=used, log_force=np.broadcast_to(readings.log_force, used.shape))
    draws = sample_posteriors(seen, priors, warm_up=effort.warm_up, draws=effort.draws)
    return {
        name: {
            key: values.reshape(len(masks), -1, *values.shape[2:])[k]
            for key, values in draws.items()
        }
        for k, name in enumerate(masks)
    }


def _slopes(weights: Floats, ratios: Floats, displacement: Floats, logs: Floats) -> Floats:
    """Differentiates logarithms of forces by those of the constants (n, 3)."""
    base = np.log(displacement)
    return np.asarray(
        jax.jacfwd(lambda at: log_force(weights, ratios, base, at))(jnp.asarray(logs))
    )


def _rank_mechanisms(
    found: FittedPopulation, begin: Constants, curve: PosedCurve, residual: Floats
) -> list[RankedMechanism]:
    asked, middle = found.asked, medians(found.posteriors[""])
    constants = begin.at(ELASTIC_NAMES, middle["mean"])
    paths, fitted = [], []
    for kind, emulator in found.emulators.items():
        far = float(emulator.displacement[-1])
        at = far * np.arange(1, asked.points + 1) / asked.points
        paths.append(follow_test(asked.lattice, kind, constants, far))
        fitted.append(_slopes(emulator.weights(at), emulator.centre, at, middle["mean"]))
    specimen, test = asked.predict.lattice, asked.predict.test
    path = follow_test(specimen, test, constants, float(curve.displacement[-1]))
    slope = _slopes(curve.weights, curve.ratios, curve.displacement, middle["mean"])
    spread = middle["spread"]
    slopes = FittedSlopes(fitted, slope)
    return rank_mechanisms(paths, path, slopes, spread, curve.displacement, residual)


def _constant_variables(found: FittedPopulation) -> dict[str, tuple]:
    """Computes quantiles of the posterior of means, spreads, samples and errors."""
    draws = found.posteriors[""]
    logs = np.quantile(draws["mean"], QUANTILES, axis=0)
    chains = [
        draws[name].reshape(found.asked.sampling.chains, found.asked.sampling.draws, -1)
        for name in ("mean", "spread", "discrepancy", "mounting", "reading")
    ]
    errors = {
        name: np.quantile(draws[name], QUANTILES, axis=0)
        for name in ("spread", "discrepancy", "mounting", "reading")
    }
    samples = np.quantile(draws["constants"], QUANTILES, axis=0)
    by_test = ("quantile", "test")
    return {
        "mean": (("quantile", "constant"), np.exp(logs)),
        "spread": (("quantile", "constant"), errors["spread"]),
        "of_sample": (("quantile", "sample", "constant"), np.exp(samples)),
        "discrepancy": ("quantile", errors["discrepancy"]),
        "mounting": (by_test, errors["mounting"]),
        "reading": (by_test, errors["reading"]),
        "correlation": (("constant", "with_constant"), np.corrcoef(draws["mean"].T)),
        "r_hat": ((), float(max(gelman_rubin(each).max() for each in chains))),
        "diverging": ((), float(draws["diverging"].mean())),
        "emulator_error": ("test", np.array([each.error for each in found.emulators.values()])),
        "emulator_error_predicted": ((), found.predicted.error),
    }


def _prediction_variables(
    found: FittedPopulation,
    curve: PosedCurve,
    bands: Mapping[str, PredictionBand],
    truth: Floats,
    folder: Path,
) -> dict[str, tuple]:
    """Assembles the prediction, the measured curve and the one that others simulated."""
    asked, at = found.asked.predict, curve.displacement
    theirs = np.full(len(at), np.nan)
    if asked.simulated is not None:
        wanted = {asked.columns.displacement: units.LENGTH, asked.columns.force: units.FORCE}
        theirs = interpolate_curve(
            at, csv_columns.read_quantities(folder / asked.simulated, wanted)
        )
    along = ("predicted",)
    own, doubled, student = (bands[name] for name in ("", "doubled", "student"))
    return {
        "displacement": (along, at),
        "measured": (along, np.exp(truth)),
        "simulated": (along, theirs),
        "median": (along, np.exp(own.median)),
        "low": (along, np.exp(own.low)),
        "high": (along, np.exp(own.high)),
        "doubled_median": (along, np.exp(doubled.median)),
        "doubled_low": (along, np.exp(doubled.low)),
        "doubled_high": (along, np.exp(doubled.high)),
        "student_low": (along, np.exp(student.low)),
        "student_high": (along, np.exp(student.high)),
        "inside": ((), int(own.holds(truth))),
        "width_to_student": ((), own.half_width / student.half_width),
    }


def interpolate_curve(at: Floats, curve: Floats) -> Floats:
    """Interpolates a curve (lines, 2) of displacement and force, NaN beyond its ends."""
    displacement, force = curve.T
    return np.interp(at, displacement, force, left=np.nan, right=np.nan)


def _mechanism_variables(ranked: Sequence[RankedMechanism]) -> dict[str, tuple]:
    each = ("mechanism",)
    return {
        "mechanism": (each, [one.name for one in ranked]),
        "size": (each, [one.size for one in ranked]),
        "explained": (each, np.array([one.explained for one in ranked])),
        "explained_alone": (each, np.array([one.alone for one in ranked])),
        "wanted": (each, np.array([one.wanted for one in ranked])),
        "change": ((*each, "predicted"), np.array([one.change for one in ranked])),
    }


class _HeldOutCurve(NamedTuple):
    without: str
    curve: str
    inside: bool
    half_width: float
    deviation: float


def _leave_one_out(found: FittedPopulation, random: np.random.Generator) -> dict[str, tuple]:
    """Predicts every sample's own curves from fits without it, and without its kind of test."""
    told = [
        _predict_left_out(found, without, single, random)
        for without in found.posteriors
        for single in found.curves
        if len(single.samples) == 1 and without in (single.samples[0], single.test)
    ]
    each = ("left_out",)
    return {
        "without": (each, [one.without for one in told]),
        "left_out_curve": (each, [one.curve for one in told]),
        "left_out_inside": (each, np.array([one.inside for one in told], np.int8)),
        "left_out_half_width": (each, np.array([one.half_width for one in told])),
        "left_out_deviation": (each, np.array([one.deviation for one in told])),
    }


def _predict_left_out(
    found: FittedPopulation, without: str, single: SampleCurve, random: np.random.Generator
) -> _HeldOutCurve:
    emulator, kind = found.emulators[single.test], list(found.emulators).index(single.test)
    thin = single.thinned(float(emulator.displacement[-1]), found.asked.points)
    curve = pose_curve(emulator, thin.displacement, kind)
    sample = found.asked.samples.index(single.samples[0])
    drawn = new_curves(curve, found.posteriors[without], random, sample=sample, repeats=_REPEATS)
    band = find_band(drawn)
    truth = np.log(thin.force)
    deviation = float((truth - band.median).mean())
    return _HeldOutCurve(without, single.name, bool(band.holds(truth)), band.half_width, deviation)


def _point_variables(found: FittedPopulation) -> dict[str, tuple]:
    """Assembles every reading of the fit, and the curves of the samples' median constants."""
    logs = medians(found.posteriors[""])["constants"]
    made = [pose_curve(each, each.displacement, 0) for each in found.emulators.values()]
    used = found.readings.used > 0
    return {
        "curve": ("point", [name for row in found.names for name in row]),
        "point_displacement": ("point", np.exp(found.readings.base)[used]),
        "point_force": ("point", np.exp(found.readings.log_force)[used]),
        "fit_displacement": (("test", "step"), np.array([each.displacement for each in made])),
        "fit_force": (
            ("test", "sample", "step"),
            np.exp(np.array([each.predict(logs) for each in made])),
        ),
    }
