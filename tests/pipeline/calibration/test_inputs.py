"""A mistake in a calibration or in its files is told in one message, and nothing is written."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.__main__ import run_stage
from pipeline.calibration.experiments.experiment import MeasuredValues
from pipeline.problem.fields import csv_columns, units
from pipeline.runtime import UserError
from tests.pipeline.calibration.specimens import (
    START,
    STIFFNESS,
    decay_set,
    described,
    force_sets,
    written,
)

WANTED = {"displacement": units.LENGTH, "force": units.FORCE}
ROWS = "\n".join(f"{k},{2 * k}" for k in range(1, 8))


def refused(text: str, folder: Path) -> UserError:
    path = folder / "readings.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as caught:
        csv_columns.read_quantities(path, WANTED, least=5)
    assert caught.value.file == str(path)
    assert caught.value.remedy
    return caught.value


def test_units_of_columns_are_minded(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"# a comment\nforce [kN];displacement (cm)\n{ROWS.replace(',', ';')}\n")
    found = csv_columns.read_quantities(path, WANTED, least=5)
    np.testing.assert_allclose(found[0], [20.0, 1000.0])


@pytest.mark.parametrize("comment", ["# Zwick; compression\tof s1", "Operator; Meier\ttoday"])
def test_a_separator_in_a_comment_is_none(comment: str, tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"{comment}\ndisplacement (mm),force (N)\n{ROWS}\n")
    np.testing.assert_allclose(csv_columns.read_quantities(path, WANTED)[-1], [7.0, 14.0])
    path.write_text(f"{comment}, again\ndisplacement (mm);force (N)\n1,5;-2,5e1\n\n2;3\n")
    found = csv_columns.read_quantities(path, WANTED)
    np.testing.assert_allclose(found, np.array([[1.5, -25.0], [2.0, 3.0]]))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"displacement (mm),load (N)\n{ROWS}", "columns are missing"),
        (f"displacement (mm),force\n{ROWS}", "the unit of the column is missing"),
        (f"displacement (s),force (N)\n{ROWS}", "the unit 's' is not that of a length"),
        (f"displacement (mm),force (N)\n{ROWS}\n8,nan", "not a finite number"),
        (f"displacement (mm),force (N)\n{ROWS}\n8,", "not a finite number"),
        ("displacement (mm),force (N)\n1,2\n2,4", "only 2 lines of numbers"),
    ],
)
def test_faulty_columns(text: str, told: str, tmp_path: Path) -> None:
    assert refused(text, tmp_path).what == told


def test_the_line_of_a_gap_is_told(tmp_path: Path) -> None:
    assert refused(f"displacement (mm),force (N)\n{ROWS}\n8,x\n", tmp_path).line == 9


def measured_decay(lines: list[str], folder: Path) -> Path:
    (folder / "decay.csv").write_text("\n".join(["time (s),angle (deg)", *lines]))
    each = {"kind": "free_decay", "name": "decay", "file": "decay.csv"}
    text = described([each], ["damping_ratio"])
    del text["virtual"]
    return written(folder, text)


@pytest.mark.parametrize(
    ("change", "told"),
    [({}, "no decaying oscillation is seen"), ({20: 0.005}, "the clock does not ascend")],
)
def test_faulty_traces(
    change: dict[int, float], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = {k: k / 100 for k in range(64)} | change
    path = measured_decay([f"{clock[k]},{k}" for k in range(64)], tmp_path)
    assert run_stage("calibrate", [str(path), "--out", str(tmp_path / "found.nc")]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {told}")
    assert "Traceback" not in said
    assert not (tmp_path / "found.nc").exists()


FREE = {"translation": "2.9e-2 kg/s", "rotation": "1.2e-7 kg m^2/s"}


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"fit": ["k"]}, "not one of the choices"),
        ({"fit": ["contact_cutoff"]}, "the cut-off of no contact is wanted"),
        ({"fit": ["damping_rotation"]}, "the damping starts from ratio"),
        ({"material": START | {"damping": FREE}, "fit": ["damping_ratio"]}, "the damping starts"),
        ({"fit": ["shear_stiffness", "shear_stiffness"]}, "a constant is named twice"),
        ({"data": [decay_set(), decay_set()]}, "two sets have one name"),
        ({"virtual": None}, "data are computed with true constants"),
        ({"spacing": 15}, "the unit is missing"),
    ],
)
def test_faulty_calibrations(
    changed: dict[str, object], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, described(force_sets(), STIFFNESS) | changed)
    assert run_stage("calibrate", [str(path), "--out", str(tmp_path / "found.nc")]) == 2
    assert told in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]


def test_computed_data_have_to_be_computed_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, described([decay_set()], ["damping_ratio"]))
    assert run_stage("calibrate", [str(path), "--out", str(tmp_path / "found.nc")]) == 2
    assert "synthesise" in capsys.readouterr().err


def test_whitened_values_have_no_correlation_left() -> None:
    """Of noise that differs, a bias of each channel, and two causes common to all."""
    random = np.random.default_rng(3)
    sigma, channel = random.uniform(0.5, 2.0, 12), np.repeat([0, 1, 4], 4)
    bias, causes = np.repeat([0.7, 2.0, 0.1], 4), random.normal(size=(12, 2))
    at = np.arange(12.0)
    measured = MeasuredValues("a", "track", at, at, sigma, True, channel, bias).with_common(causes)
    covariance = np.diag(sigma**2) + causes @ causes.T
    covariance += np.where(channel[:, None] == channel, np.outer(bias, bias), 0.0)
    white = measured.whitened(np.eye(12))
    np.testing.assert_allclose(white @ covariance @ white.T, np.eye(12), atol=1e-10)
    np.testing.assert_allclose(
        np.stack([measured.transposed(row) for row in np.eye(12)], axis=1), white.T, atol=1e-12
    )


def test_an_unknown_bias_leaves_nothing_of_the_means() -> None:
    channel = np.repeat([0, 1], 5)
    at = np.arange(10.0)
    measured = MeasuredValues("a", "track", at, at, np.ones(10), True, channel, np.full(10, np.inf))
    shifted = at + np.where(channel == 0, 3.0, -8.0)
    np.testing.assert_allclose(measured.whitened(shifted), measured.whitened(at), atol=1e-12)
    assert measured.unbiased == 2
