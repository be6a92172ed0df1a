from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.calibration.experiments.experiment import MeasuredValues
from pipeline.problem.fields import csv_columns, units
from pipeline.runtime import UserError
from sim.core import Floats
from tests.pipeline.calibration.specimens import (
    STIFFNESS,
    decay_set,
    described,
    force_sets,
    written,
)
from tests.pipeline.conftest import Failing
from tests.tables import cases, refused

WANTED = {"displacement": units.LENGTH, "force": units.FORCE}
ROWS = "\n".join(f"{k},{2 * k}" for k in range(1, 8))


def refusal(text: str, folder: Path) -> UserError:
    path = folder / "readings.csv"
    path.write_text(text, encoding="utf-8")
    with refused("", file=path) as caught:
        csv_columns.read_quantities(path, WANTED, least=5)
    error: UserError = caught.value
    return error


def test_units_of_columns_are_minded(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"# a comment\nforce [kN];displacement (cm)\n{ROWS.replace(',', ';')}\n")
    found = csv_columns.read_quantities(path, WANTED, least=5)
    np.testing.assert_allclose(found[0], [20.0, 1000.0])


@pytest.mark.parametrize(
    "heading",
    [
        "displacement,force,note\ncm,kN,none of ours",
        "displacement,force\n(cm),(kN)",
        "displacement,force (kN)\ncm",
        "displacement / cm,force\n,kN",
    ],
)
def test_units_may_stand_in_the_line_below_the_names(heading: str, tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"{heading}\n{ROWS}\n")
    found = csv_columns.read_quantities(path, WANTED, least=7)
    np.testing.assert_allclose(found[0], [10.0, 2000.0])
    assert len(found) == 7


WEIGHTS = {"lbf": 4.4482216, "LBF": 4.4482216, "kgf": 9.80665, "Kgf": 9.80665, "gf": 9.80665e-3}


@pytest.mark.parametrize(("unit", "newtons"), [*WEIGHTS.items(), ("KN", 1000.0)])
@pytest.mark.parametrize("form", ["displacement (mm),force ({})", "displacement,force\nmm,{}"])
def test_forces_are_read_in_weights(form: str, unit: str, newtons: float, tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"{form.format(unit)}\n{ROWS}\n")
    np.testing.assert_allclose(csv_columns.read_quantities(path, WANTED)[0], [1.0, 2 * newtons])


UNKNOWN = ["ozf", "daN", "kips", "tonf", "pounds", "pulses"]


@pytest.mark.parametrize("unit", UNKNOWN)
@pytest.mark.parametrize("heading", ["displacement (mm),force ({})", "displacement,force\nmm,{}"])
def test_numbers_in_an_unknown_unit_are_to_be_converted(
    heading: str, unit: str, tmp_path: Path
) -> None:
    error = refusal(f"{heading.format(unit)}\n{ROWS}\n", tmp_path)
    assert error.what == f"unknown unit '{unit}'"
    assert error.remedy == "convert the numbers to N, and write the heading as force (N)"


@pytest.mark.parametrize("unit", ["Mm", "Gm"])
@pytest.mark.parametrize("heading", ["displacement ({}),force (N)", "displacement,force\n{},N"])
def test_a_unit_that_nobody_uses_is_refused(heading: str, unit: str, tmp_path: Path) -> None:
    error = refusal(f"{heading.format(unit)}\n{ROWS}\n", tmp_path)
    assert error.what == f"nobody measures a length in '{unit}'"
    assert (error.key, error.value) == ("displacement", unit)
    assert "write mm if meant" in (error.remedy or "")


def test_a_word_that_ends_a_title_is_no_unit(tmp_path: Path) -> None:
    """Min would be a million inches."""
    path = tmp_path / "readings.csv"
    path.write_text("way_Min,force\n1.5,2\n", encoding="utf-8")
    wanted = {"way_Min": units.LENGTH, "force": units.FORCE}
    found = csv_columns.read_columns(path, list(wanted), list(wanted.values()))
    np.testing.assert_array_equal(found, [[1.5, 2.0]])


@pytest.mark.parametrize("between", ["", "CH1,CH2", "# in mm, N"])
@pytest.mark.parametrize("told", ["um,kN", "\u00b5m,kN", "\u03bcm,KN", "(um),(kN)", "UM,KN"])
def test_the_line_of_units_may_follow_others(between: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"displacement,force\n{between}\n{told}\n{ROWS}\n", encoding="utf-8")
    for found in (
        csv_columns.read_quantities(path, WANTED, least=7),
        csv_columns.read_columns(path, list(WANTED), list(WANTED.values())),
    ):
        np.testing.assert_allclose(found[0], [1e-3, 2000.0])


def test_a_name_that_occurs_twice_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text("# two\nway,force (kN),force (N)\nmm,,\n0,1,2\n", encoding="utf-8")
    wanted = {"way": units.LENGTH, "force": units.FORCE}
    with refused("columns 2 (force (kN)) and 3 (force (N))", "force", file=path) as caught:
        csv_columns.read_quantities(path, wanted)
    assert caught.value.line == 2
    whole = {"way": units.LENGTH, "force (kN)": units.FORCE}
    np.testing.assert_array_equal(csv_columns.read_quantities(path, whole), [[0.0, 1000.0]])


@pytest.mark.parametrize("told", ["(s),(mm),(N)", "s,mm,N"])
def test_the_names_of_a_file_are_told_not_its_preamble(told: str, tmp_path: Path) -> None:
    text = f'"Label","S1"\n"Rate",5.00,"mm/min"\n\nTime,Extension,Load\n{told}\n0,0,1\nMax,1,2\n'
    remedy = refusal(text, tmp_path).remedy or ""
    assert "it has: Time" in remedy
    assert "Load" in remedy


def read_them(path: Path, wanted: dict[str, units.Dimension]) -> Floats:
    """Reads columns with gaps."""
    return csv_columns.read_columns(path, list(wanted), list(wanted.values()))


@pytest.mark.parametrize("comment", ["# Zwick; compression\tof s1", "Operator; Meier\ttoday"])
def test_a_separator_in_a_comment_is_none(comment: str, tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"{comment}\ndisplacement (mm),force (N)\n{ROWS}\n")
    np.testing.assert_allclose(csv_columns.read_quantities(path, WANTED)[-1], [7.0, 14.0])
    path.write_text(f"{comment}, again\ndisplacement (mm);force (N)\n1,5;-2,5e1\n\n2;3\n")
    found = csv_columns.read_quantities(path, WANTED)
    np.testing.assert_allclose(found, np.array([[1.5, -25.0], [2.0, 3.0]]))


@pytest.mark.parametrize("read", [csv_columns.read_quantities, read_them])
def test_commas_that_part_numbers_and_begin_decimals_are_refused(
    read: Callable[..., Floats], tmp_path: Path
) -> None:
    path = tmp_path / "readings.csv"
    path.write_text("displacement (mm),force (N)\n0,0\n0,5,1,25\n")
    with pytest.raises(UserError, match="more numbers than the heading has names") as error:
        read(path, WANTED)
    assert error.value.line == 3
    path.write_text("displacement (mm),force (N)\n0,0,,\n0.5,1.25,slipped\n")
    assert read(path, WANTED).shape == (2, 2)


@cases("calibration", "text, told")
def test_faulty_columns(text: str, told: str, tmp_path: Path) -> None:
    error = refusal(text, tmp_path)
    assert error.what == told
    assert ("\n8," not in text) or error.line == 9


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
def test_bad_traces(change: dict[int, float], told: str, tmp_path: Path, failing: Failing) -> None:
    clock = {k: k / 100 for k in range(64)} | change
    path = measured_decay([f"{clock[k]},{k}" for k in range(64)], tmp_path)
    said = failing("calibrate", [str(path), "--out", str(tmp_path / "found.nc")])
    assert said.startswith(f"error: {told}")


FREE = {"translation": "2.9e-2 kg/s", "rotation": "1.2e-7 kg m^2/s"}


@cases("calibration", "changed, told")
def test_faulty_calibrations(
    changed: dict[str, object], told: str, tmp_path: Path, failing: Failing
) -> None:
    path = written(tmp_path, described(force_sets(), STIFFNESS) | changed)
    assert told in failing("calibrate", [str(path), "--out", str(tmp_path / "found.nc")])
    assert list(tmp_path.iterdir()) == [path]


OWN = """kind,number,x (mm),y (mm),shear (N/mm)
unit,0,0,0,
unit,0,6,0,
unit,0,6,6,
unit,1,8,6,
unit,1,14,6,
unit,1,14,12,
ligament,0,6,6,2.0
ligament,0,8,6,2.0
"""


def test_stiffnesses_of_single_ligaments_are_refused(tmp_path: Path, failing: Failing) -> None:
    (tmp_path / "own.csv").write_text(OWN, encoding="utf-8")
    own = {"kind": "file", "file": "own.csv", "spacing": "8 mm"}
    data = [each | {"lattice": own} for each in force_sets()]
    path = written(tmp_path, described(data, ["shear_stiffness"]))
    told = failing("calibrate", [str(path), "--out", str(tmp_path / "found.nc")])
    assert "leave those columns out" in told
    assert "data[0].lattice" in told
    (tmp_path / "own.csv").write_text(OWN.replace("2.0", ""), encoding="utf-8")
    told = failing("calibrate", [str(path), "--out", str(tmp_path / "found.nc")])
    assert "synthesise" in told


def test_computed_data_have_to_be_computed_first(tmp_path: Path, failing: Failing) -> None:
    path = written(tmp_path, described([decay_set()], ["damping_ratio"]))
    assert "synthesise" in failing("calibrate", [str(path), "--out", str(tmp_path / "found.nc")])


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
