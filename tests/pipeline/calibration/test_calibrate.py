"""The constants of computed specimens are found again, with the errors that the noise makes."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from scipy.special import stdtrit

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.calibration import fit_calibration
from pipeline.calibration.fit_uncertainty import adjoint_gradient, estimate_errors
from pipeline.calibration.inputs import Calibration
from pipeline.calibration.least_squares import Fit
from pipeline.problem.reading import load_section
from pipeline.problem.sections import MaterialConstants
from tests.pipeline.calibration.specimens import (
    STIFFNESS,
    TRUTH,
    decay_set,
    described,
    force_sets,
    synthesised,
    written,
)
from tests.pipeline.conftest import Failing

ALL = [*STIFFNESS, "damping_ratio"]
TRUE = {"axial_stiffness": 120.0, "shear_stiffness": 1.19, "bending_stiffness": 1.5}
TRUE |= {"damping_ratio": 0.0186, "damping_translation": 2.8768e-5, "damping_rotation": 1.1884e-4}


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Fit]:
    """A folder with a calibration of forces and a decay and with what was found, and the fit."""
    folder, fits = tmp_path_factory.mktemp("calibration"), list[Fit]()
    path = synthesised(folder, described([*force_sets(), decay_set()], ALL, title="A specimen"))

    def fitted(asked: Calibration, path: Path) -> Fit:
        fits.append(fit_calibration(asked, path))
        return fits[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pipeline.stages.calibrate.fit_calibration", fitted)
        words = [str(path), "--out", str(folder / "found.nc"), "--quiet"]
        assert run_stage("calibrate", words) == 0
    return folder, fits[0]


@pytest.fixture(scope="module")
def made(calibrated: tuple[Path, Fit]) -> Path:
    return calibrated[0]


@pytest.fixture(scope="module")
def found(made: Path) -> xr.Dataset:
    return datasets.read(made / "found.nc", "calibration")


@pytest.mark.slow
def test_the_truth_is_within_the_intervals(found: xr.Dataset) -> None:
    names = found["parameter"].values.tolist()
    assert names == [*ALL, "damping_translation", "damping_rotation"]
    true = np.array([TRUE[name] for name in names])
    assert (found["lower"].values < true).all()
    assert (true < found["upper"].values).all()
    assert (found["standard_error"].values < 0.1).all()
    assert (found["status"].values == 0).all()
    assert found["peak_ratio"].sel(set="decay").item() == pytest.approx(0.0186, rel=0.15)
    assert np.isnan(found["peak_ratio"].sel(set="shear"))


def test_errors_are_those_of_the_bound_where_drives_have_no_noise(found: xr.Dataset) -> None:
    np.testing.assert_allclose(found["standard_error"], found["bound"], rtol=1e-8)
    width = np.log(found["upper"].values / found["lower"].values)
    reach = width / found["standard_error"].values / 2
    # noise is estimated set by set: of a constant that a short one tells it is known the least
    least, most = found["freedom"].values.min(), found["freedom"].values.sum()
    assert (reach > stdtrit(most, 0.975) * (1 - 1e-9)).all()
    assert (reach < stdtrit(least, 0.975) * (1 + 1e-9)).all()
    assert reach.max() > 1.02 * stdtrit(most, 0.975)
    below, above = (found[end].values / found["value"].values for end in ("lower", "upper"))
    np.testing.assert_allclose(np.log(above), -np.log(below), rtol=1e-9)
    covariance, error = found["covariance"].values, found["standard_error"].values
    np.testing.assert_allclose(np.diag(covariance), error**2)
    np.testing.assert_allclose(found["correlation"], covariance / np.outer(error, error))


def test_noise_is_estimated_and_leaves_nothing_but_noise(found: xr.Dataset) -> None:
    told = found["sigma"].groupby(found["set_of_point"]).mean().values
    assert told[:3] == pytest.approx(0.02, rel=0.5)
    assert told[3] == pytest.approx(np.deg2rad(0.2), rel=0.15)
    assert found["chi_square"].values == pytest.approx(found["freedom"].values, rel=1e-2)
    assert (np.abs(found["autocorrelation"]) < 0.5).all()
    assert found.attrs["warnings"] == ""


def test_a_problem_file_takes_the_fragment(made: Path) -> None:
    text = (made / "found.yaml").read_text()
    assert text.startswith("# SYNTHETIC")
    material = MaterialConstants.model_validate(yaml.safe_load(text)["material"])
    found = datasets.read(made / "found.nc", "calibration").set_index(parameter="parameter")
    assert material.shear_stiffness == pytest.approx(found["value"].values[1], rel=1e-5)
    assert material.damping_coefficients(15.0) == pytest.approx(found["value"].values[4:], rel=1e-5)


@pytest.mark.slow
def test_the_same_files_give_the_same_bytes(made: Path, tmp_path: Path) -> None:
    again = ["--out", str(tmp_path / "found.nc"), "--quiet"]
    assert run_stage("calibrate", [str(made / "data/calibration.yaml"), *again]) == 0
    for name in ("found.nc", "found.yaml"):
        assert (tmp_path / name).read_bytes() == (made / name).read_bytes()


def test_columns_of_the_jacobian_are_those_of_the_adjoint(calibrated: tuple[Path, Fit]) -> None:
    fit = calibrated[1]
    random = np.random.default_rng(4).normal(size=len(fit.residual))
    elsewhere = fit._replace(residual=random)
    columns = (fit.jacobian.T @ random)[: len(ALL)]
    np.testing.assert_allclose(adjoint_gradient(elsewhere), columns, rtol=1e-5)
    assert estimate_errors(fit).newton < 1e-3


def test_little_noise_makes_errors_below_one_percent(tmp_path: Path) -> None:
    sets = [*force_sets("0.0005 N"), decay_set("0.005 deg")]
    path = synthesised(tmp_path, described(sets, ALL))
    fit = fit_calibration(load_section(path, Calibration), path)
    constants = fit.model.constants(fit.unknowns)
    for name in fit.model.names:
        assert constants.value(name) == pytest.approx(TRUE[name], rel=0.01)


def test_what_data_do_not_tell_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = synthesised(tmp_path, described([decay_set()], ["damping_ratio", "shear_stiffness"]))
    assert run_stage("calibrate", [str(path), "--out", str(tmp_path / "found.nc")]) == 0
    assert "shear_stiffness is not determined by these data" in capsys.readouterr().err
    found = datasets.read(tmp_path / "found.nc", "calibration")
    assert found["status"].values.tolist()[:2] == [0, 2]
    assert "shear_stiffness: 1.19 " not in (tmp_path / "found.yaml").read_text()


def test_a_trace_that_swings_otherwise_than_its_law_is_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    time = np.arange(256) / 960
    # of two squares, one of them held: the other swings about the ligament, not about its middle
    angle = 8.0 * np.exp(-0.02 * 184.0 * time) * np.cos(184.0 * time)
    rows = [f"{t:.6f},{a:.6f}" for t, a in zip(time, angle, strict=True)]
    (tmp_path / "decay.csv").write_text("\n".join(["time (s),angle (deg)", *rows]))
    each = {"kind": "free_decay", "name": "decay", "file": "decay.csv"}
    text = {**described([each], ["damping_ratio"]), "material": TRUTH}
    del text["virtual"]
    path = written(tmp_path, text)
    assert run_stage("calibrate", [str(path), "--out", str(tmp_path / "found.nc")]) == 0
    said = capsys.readouterr().err
    assert "decay: the trace swings at 29.3 Hz, where one unit on one ligament" in said
    assert "turns at 74.7 Hz" in said


def test_the_constants_are_not_written_over_their_description(made: Path, failing: Failing) -> None:
    path = made / "calibration.yaml"
    before = path.read_bytes()
    told = failing("calibrate", [str(path), "--out", str(path.with_suffix(".nc"))])
    assert "would be written over" in told
    assert path.read_bytes() == before


def test_the_constants_replace_no_problem_file(made: Path, failing: Failing) -> None:
    """Of the same stem as the result; those of an earlier call are found anew."""
    problem = made / "found.yaml"
    problem.write_text("material: {}\n")
    told = failing("calibrate", [str(made / "calibration.yaml"), "--out", str(made / "found.nc")])
    assert "would be written over" in told
    assert problem.read_text() == "material: {}\n"
