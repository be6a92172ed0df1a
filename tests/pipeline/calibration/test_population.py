from collections.abc import Mapping
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import stdtrit

from pipeline.__main__ import run_stage
from pipeline.calibration.experiments import force_displacement
from pipeline.calibration.inputs import ELASTIC_NAMES, Constants, Population, SampleTest
from pipeline.calibration.inputs.description import TestKind
from pipeline.calibration.population import (
    curve_emulator,
    hierarchical_model,
    missing_physics,
    prediction,
    sample_readings,
    validation_study,
)
from pipeline.calibration.population.curve_emulator import CurveEmulator
from pipeline.calibration.population.sample_readings import SampleCurve
from pipeline.problem.reading import load_section
from pipeline.runtime import ROOT
from pipeline.stages import validate
from tests.tables import cases, refused

FILE = ROOT / "experiments/validation/hinges.yaml"
SAMPLES = ("s1", "s2")


@pytest.fixture(scope="module")
def asked() -> Population:
    return load_section(FILE, Population)


@pytest.fixture(scope="module")
def centre(asked: Population) -> Constants:
    return Constants(asked.material, None, asked.spacing)


@pytest.fixture(scope="module")
def emulator(asked: Population, centre: Constants) -> CurveEmulator:
    return curve_emulator.emulate(asked.lattice, "compression", centre, 3.75)


def test_constants_beyond_the_simulated_ratios_are_counted(centre: Constants) -> None:
    middle = centre.logs(ELASTIC_NAMES)
    ratios = middle[[0, 2]] - middle[1]
    (_, axial), (bending, _) = curve_emulator.REACH
    inside = middle + np.array([axial - 0.1, 0.0, bending + 0.1])
    assert curve_emulator.share_beyond(ratios, inside[None]) == 0.0
    others = inside + np.array([[0.2, 0.0, 0.0], [0.0, 0.0, -0.2], [0.3, 0.3, 0.3], [0, 0, 1]])
    assert curve_emulator.share_beyond(ratios, others) == 0.5
    flat = np.ones((2, 1, *(order + 1 for order in curve_emulator.ORDERS)))
    base = np.zeros(1)
    stays = [
        float(
            curve_emulator.log_force(
                flat[0], ratios, base, middle + np.array([axial + more, 0, 0])
            )[0]
        )
        for more in (0.1, 1.0)
    ]
    assert stays[0] == pytest.approx(stays[1])


def curves(*factors: float) -> list[SampleCurve]:
    """Made of a square root, times a factor each, and their mean."""
    way = np.linspace(0.0, 3.75, 76)
    own = [
        SampleCurve(f"compression_{name}", "compression", (name,), way, factor * np.sqrt(way))
        for name, factor in zip(SAMPLES, factors, strict=True)
    ]
    mean = np.mean(factors) * np.sqrt(way)
    return [*own, SampleCurve("compression_s1+s2", "compression", SAMPLES, way, mean)]


@pytest.mark.slow
def test_emulated_curves(asked: Population, centre: Constants, emulator: CurveEmulator) -> None:
    assert emulator.error < 5e-4
    at = np.array([0.4, 1.7, 3.6])
    logs = centre.logs(ELASTIC_NAMES) + np.array([0.6, -0.2, 0.3])
    constants = centre.at(ELASTIC_NAMES, logs)
    posed = force_displacement.pose_simulation(asked.lattice, "compression", centre, at)
    weights, base = emulator.weights(at), np.log(at)

    def total(place: jax.Array) -> jax.Array:
        return jnp.exp(curve_emulator.log_force(weights, emulator.centre, base, place)).sum()

    np.testing.assert_allclose(total(jnp.asarray(logs)), posed.predict(constants).sum(), rtol=5e-4)
    by_adjoint = posed.pull_back(constants, np.ones(3))[:3] * np.exp(logs)
    np.testing.assert_allclose(jax.grad(total)(jnp.asarray(logs)), by_adjoint, atol=2e-3)


def test_readings_are_thinned_and_shared(emulator: CurveEmulator) -> None:
    known: Mapping[TestKind, CurveEmulator] = {"compression": emulator}
    found, names = sample_readings.stack_readings(curves(1.0, 1.2), known, SAMPLES, 5)
    assert found.used.shape == (1, 15)
    assert names[0][::5] == ["compression_s1", "compression_s2", "compression_s1+s2"]
    np.testing.assert_allclose(
        np.asarray(found.shares)[0, ::5], np.array([[1, 0], [0, 1], [0.5, 0.5]])
    )
    np.testing.assert_allclose(found.place[0, :5], np.linspace(0.2, 1, 5), atol=0.05)
    ratio = np.exp(np.asarray(found.log_force)[0, 5:10] - np.asarray(found.log_force)[0, :5])
    np.testing.assert_allclose(ratio, 1.2)
    some = found._replace(used=found.used * (np.arange(15) < 10))
    made = np.asarray(some.covariance(np.array(0.1), np.array([0.05]), np.array([0.01])))[0]
    np.testing.assert_allclose(made[10:], np.eye(15)[10:], atol=1e-6)
    # d of all samples goes together, and with it what a mounting changes in one
    np.testing.assert_allclose(made[0, 0], 0.1**2 + 0.05**2 + 0.01**2, rtol=1e-3)
    np.testing.assert_allclose(made[0, 5], 0.1**2, rtol=1e-3)


def test_the_band_holds_whole_curves() -> None:
    random = np.random.default_rng(0)
    drawn = 0.1 * random.standard_t(3, size=(20_000, 1)) + 0.02 * random.normal(size=(20_000, 12))
    band = prediction.find_band(drawn)
    assert abs(band.holds(drawn).mean() - 0.95) < 1e-3
    assert ((drawn >= band.low) & (drawn <= band.high)).mean() > 0.955


def test_students_interval_of_a_few_samples(emulator: CurveEmulator) -> None:
    curve = prediction.pose_curve(emulator, np.array([1.0, 2.0]), 0)
    logs = np.log([120.0, 1.2, 1.5]) + np.array([-0.1, 0.0, 0.1])[:, None]
    band = prediction.student_band(curve, logs)
    reach = 4.302653 * 0.1 * np.sqrt(4 / 3)
    np.testing.assert_allclose(band.half_width, reach, rtol=1e-6)
    np.testing.assert_allclose(band.median, curve.predict(logs[1]))


def test_a_known_sample_is_predicted_better_than_a_new_one(emulator: CurveEmulator) -> None:
    count = 2000
    logs = np.log([120.0, 1.2, 1.5])
    draws = {
        "mean": np.tile(logs, (count, 1)),
        "spread": np.full((count, 3), 0.1),
        "constants": np.tile(logs, (count, 2, 1)),
        "discrepancy": np.full(count, 0.02),
        "mounting": np.full((count, 1), 0.01),
        "reading": np.full((count, 1), 0.001),
    }
    curve = prediction.pose_curve(emulator, np.array([1.0, 2.0, 3.0]), 0)
    random = np.random.default_rng(0)
    new = prediction.new_curves(curve, draws, random, repeats=1)
    known = prediction.new_curves(curve, draws, random, sample=0, repeats=1)
    np.testing.assert_allclose(known.std(axis=0), np.hypot(0.02, 0.01), rtol=0.1)
    assert (new.std(axis=0) > 3 * known.std(axis=0)).all()


def test_mean_and_spread_are_drawn_from_their_law() -> None:
    """Against Student's law, to which it comes where the priors tell next to nothing."""
    random = np.random.default_rng(0)
    constants = np.array([[-0.1, 0.0, 0.1, 0.0]]).T + np.array([4.0, 0.0, 1.0])
    draws = {name: np.zeros((1, 1)) for name in ("discrepancy", "mounting", "reading")}
    draws |= {name: np.zeros((1, 3)) for name in ("mean", "spread")} | {
        "constants": constants[None]
    }
    centre, flat = np.array([4.1, 0.1, 0.9]), np.log(1e4)
    priors = hierarchical_model.PriorNumbers(centre, flat, np.log([0.1] * 4), flat)
    found = prediction.redraw_population(draws, priors, random, 40_000)
    new = found["mean"] + found["spread"] * random.normal(size=found["mean"].shape)
    scale = np.sqrt(0.02 / 3) * np.sqrt(5 / 4)
    expected = constants.mean(axis=0) + scale * stdtrit(3, [[0.1], [0.5], [0.9]])
    np.testing.assert_allclose(np.quantile(new, [0.1, 0.5, 0.9], axis=0), expected, atol=0.006)

    sure = priors._replace(constants=np.array(1e-3), wide=np.array(1e-3))
    found = prediction.redraw_population(draws, sure, random, 100)
    np.testing.assert_allclose(found["mean"], np.tile(centre, (100, 1)), atol=5e-3)
    np.testing.assert_allclose(found["spread"], 0.1, rtol=6e-3)


def test_what_is_missing_is_found(asked: Population, centre: Constants) -> None:
    path = missing_physics.follow_test(asked.lattice, "shear", centre, 3.75)
    late = next(each for each in missing_physics.MECHANISMS if "late" in each.name)
    at = np.linspace(0.5, 3.75, 10)
    truth = 2 * np.interp(at, path.displacement[1:], late.change(path)[1:] / path.force[1:])
    none = missing_physics.FittedSlopes([np.zeros((5, 3))], np.zeros((10, 3)))
    ranked = missing_physics.rank_mechanisms([path], path, none, np.ones(3), at, truth)
    assert ranked[0].name == late.name
    np.testing.assert_allclose((ranked[0].explained, ranked[0].wanted), (0.5, 2.0), rtol=1e-6)


def test_the_stretch_of_sheared_ligaments_goes_by_their_length(
    asked: Population, centre: Constants
) -> None:
    """The square of the length."""
    stretch = next(each for each in missing_physics.MECHANISMS if "stretch" in each.name)
    path = missing_physics.follow_test(asked.lattice, "shear", centre, 3.75)
    assert path.length == asked.lattice.ligament_length
    longer = stretch.change(path._replace(length=2 * path.length))
    np.testing.assert_allclose(longer, 4 * stretch.change(path), rtol=1e-12)


@cases("calibration", "old, new, told")
def test_slips_in_the_file(old: str, new: str, told: str, tmp_path: Path) -> None:
    text = FILE.read_text().replace("hinge_statics/r", f"{FILE.parent}/hinge_statics/r")
    (tmp_path / "hinges.yaml").write_text(text.replace(old, new))
    with refused("") as caught:
        load_section(tmp_path / "hinges.yaml", Population)
    assert told in str(caught.value)


def test_a_mean_is_no_sample_of_both_their_names() -> None:
    names = [
        SampleTest(test="shear", samples=samples, file="one.csv").name
        for samples in (("a_b",), ("a", "b"))
    ]
    assert names == ["shear_a_b", "shear_a+b"]


def test_a_force_of_the_wrong_sign_is_refused(asked: Population, tmp_path: Path) -> None:
    lines = "\n".join(f"{k},{-k}" for k in range(20))
    (tmp_path / "pull.csv").write_text(f"displacement (mm),force (N)\n{lines}\n")
    wrong = asked.data[0].model_copy(update={"file": "pull.csv"})
    with refused("not above zero", "force", file=tmp_path / "pull.csv"):
        sample_readings.read_curve(wrong, asked.lattice, tmp_path)


def early_slack(folder: Path) -> str:
    """Writes a curve whose force is below zero on the first part of its way."""
    lines = "\n".join(f"{0.1 * k},{k - 5}" for k in range(1, 41))
    (folder / "slack.csv").write_text(f"displacement (mm),force (N)\n{lines}\n")
    return "slack.csv"


def test_forces_below_zero_early_on_are_refused_before_a_fit(
    asked: Population, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(validation_study, "emulate", lambda *_: pytest.fail("emulated"))
    slack = str(tmp_path / early_slack(tmp_path))
    samples = tuple(
        each.model_copy(update={"file": slack}) if each.test == asked.predict.test else each
        for each in asked.data
    )
    predict = asked.predict.model_copy(update={"file": slack})
    for changed in ({"data": samples, "points": 20}, {"predict": predict}):
        with refused("not above zero", "force", "record: toe", file=Path(slack)):
            validation_study.validate_population(asked.model_copy(update=changed), FILE.parent)


@pytest.mark.parametrize(("count", "told"), [(0, "no constants"), (-3, "no"), (10**6, "only")])
def test_a_count_of_draws_that_is_refused(asked: Population, count: int, told: str) -> None:
    with refused(told, "count"):
        validation_study.draw_constants(asked, FILE.parent / "nowhere", count)


def test_priors_are_doubled_in_their_logarithms(asked: Population) -> None:
    plain = hierarchical_model.prior_numbers(asked.priors, np.zeros(3))
    doubled = hierarchical_model.prior_numbers(asked.priors.doubled, np.zeros(3))
    np.testing.assert_allclose(doubled.constants, 2 * np.asarray(plain.constants))
    np.testing.assert_allclose(doubled.wide, 2 * np.asarray(plain.wide))
    np.testing.assert_allclose(doubled.medians, plain.medians)


def test_a_record_that_goes_to_and_fro_is_averaged() -> None:
    """Cycles from zero on: their force at a displacement is the mean of the cycles'."""
    way = np.linspace(0.0, 2.0, 201)
    cycles = SampleCurve("c", "compression", ("s9",), np.tile(way, 3), np.tile(3.0 * way, 3))
    shown = cycles.ascending(20)
    assert shown.displacement[0] > 0.0
    assert (np.diff(shown.displacement) > 0.0).all()
    np.testing.assert_allclose(shown.force, 3.0 * shown.displacement, rtol=1e-9)
    once = cycles._replace(displacement=way[1:], force=way[1:])
    assert once.ascending(20) is once


def test_the_stored_constants_name_the_files_that_they_were_drawn_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(validate, "draw_constants", lambda *_: np.ones((2, 3)))
    out = tmp_path / "constants.csv"
    assert run_stage("validate", ["constants", str(FILE), "--out", str(out), "--quiet"]) == 0
    made, stored = (
        [line for line in path.read_text().splitlines() if line.startswith("#")]
        for path in (out, FILE.with_name(out.name))
    )
    assert stored == made


def test_a_curve_that_others_simulated_ends_where_it_does() -> None:
    curve = np.array([[1.0, 10.0], [2.0, 30.0]])
    found = validation_study.interpolate_curve(np.array([0.9, 1.0, 1.5, 2.0, 2.1]), curve)
    np.testing.assert_array_equal(found, [np.nan, 10.0, 20.0, 30.0, np.nan])
