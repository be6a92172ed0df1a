from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.comparison import pixel_size, prepare_measurement
from tests.pipeline.comparison.recorded import FORCE, PIXEL, SIGMA, track, written
from tests.pipeline.conftest import Failing
from tests.tables import some

Change = Callable[[xr.Dataset], xr.Dataset]

THERE = np.linspace(0.0, 1.0, 25)
BACK = np.concatenate([THERE, THERE[-2:12:-1]])
TIME = np.arange(len(BACK)) / 30


@pytest.fixture(scope="module")
def study(hole: list[str], tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Options that name a small static study with its datasets."""
    problem, design = hole[1], str(Path(hole[1]).with_name("design.nc"))
    response = str(tmp_path_factory.mktemp("study") / "response.nc")
    given = ["--problem", problem, "--quiet", "--design", design]
    assert run_stage("simulate", [*given, "--out", response]) == 0
    return [*given, "--response", response]


@pytest.fixture(scope="module")
def film(study: list[str]) -> xr.Dataset:
    """The cloaked structure, loaded and then halfway unloaded."""
    design = datasets.read(study[study.index("--design") + 1], "design")
    response = datasets.read(study[study.index("--response") + 1], "response")
    return track(design, response, "cloaked", TIME, BACK)


def words(study: list[str], options: list[str], folder: Path) -> list[str]:
    return [*study, *options, "--out", str(folder / "comparison.nc")]


@pytest.fixture(scope="module")
def folder(study: list[str], film: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("whole")
    assert run_stage("compare", words(study, written(film, made), made)) == 0
    return made


@pytest.fixture
def whole(folder: Path) -> xr.Dataset:
    return datasets.read(folder / "comparison.nc", "comparison")


def test_a_simulation_that_is_right_leaves_noise_alone(whole: xr.Dataset) -> None:
    for side in whole["side"].values:
        found = whole.sel(side=side, estimate="value")
        np.testing.assert_allclose(found["rmse"], SIGMA, rtol=0.25)  # some of it by the drive
        np.testing.assert_allclose(found["noise_share"], 1.0, atol=0.4)
        assert (found["correlation"] > 0.99).all()
    apart = whole["measured"] - whole["simulated"]
    np.testing.assert_allclose(whole["residual"], apart, atol=1e-6)  # of single precision
    value, low, high = whole["rmse"].sel(side="simulated").transpose("estimate", "dof").values
    assert ((low < value) & (value < high)).all()


def test_both_branches_lie_on_the_load_axis(whole: xr.Dataset) -> None:
    assert whole.attrs["axis"] == "load"
    assert np.isnan(float(whole["time_lag"]))
    np.testing.assert_array_equal(whole["branch"][[5, 20]], 1)
    np.testing.assert_array_equal(whole["branch"][[28, -2]], 2)
    np.testing.assert_allclose(
        whole["nominal_drive"].sel(xy="x"), whole["drive_displacement"].sel(xy="x"), atol=0.02
    )


def test_free_units_are_compared_and_within_the_band(whole: xr.Dataset) -> None:
    counts = np.bincount(whole["use"].values, minlength=5).tolist()
    assert counts == [14, 5, 5, 1, 0]
    apart = whole["rmse_map"].sel(side="simulated").isnull().any("dof").values
    np.testing.assert_array_equal(apart, whole["use"].values != 0)
    assert int(whole["band_samples"]) == 64
    assert (whole["band_coverage"] > 0.95).all()
    assert (whole["band_low"].isel(time=-1) <= whole["band_high"].isel(time=-1)).sum() > 14


def test_forces_are_those_of_the_load_cell(whole: xr.Dataset) -> None:
    found = whole["force_rmse"].sel(side="nominal")
    assert float(found.sel(estimate="value")) == pytest.approx(FORCE, rel=0.3)
    assert float(found.sel(estimate="low")) < FORCE < 1.5 * float(found.sel(estimate="high"))
    assert (whole["force_nrmse"].sel(estimate="value") < 0.05).all()
    assert float(whole["load_force"].max()) > 20 * FORCE
    inside = (whole["force_low"] <= whole["nominal_force"] + FORCE) & (
        whole["nominal_force"] - FORCE <= whole["force_high"]
    )
    assert inside.all()


def test_a_load_cell_that_counts_against_the_drive_is_told_of(
    study: list[str], film: xr.Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [word for word in study if word != "--quiet"]
    for sign in (1, -1):
        made = film.assign(load_force=sign * film["load_force"])
        assert run_stage("compare", words(given, written(made, tmp_path), tmp_path)) == 0
        told = capsys.readouterr().err
        assert ("write load_cell: {reversed: true}" in told) == (sign < 0)


@pytest.mark.parametrize(
    ("offset", "keys", "told"),
    some(
        [
            (0.5, "", True),
            (0.02, "", False),
            (0.5, ", zero: start", False),
            (0.5, ", zero: file", False),
            (-0.5, "", True),
            (0.0, "", False),
        ],
        3,
    ),
)
def test_a_load_cell_that_was_not_tared_is_told_of(
    study: list[str],
    film: xr.Dataset,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    offset: float,
    keys: str,
    told: bool,
) -> None:
    """Offsets are parts of the range of forces."""
    given = [word for word in study if word != "--quiet"]
    force = film["load_force"]
    made = film.assign(load_force=force + offset * float(force.max() - force.min()))
    options = written(made, tmp_path, f"load_cell: {{file: load.csv{keys}}}\n")
    assert run_stage("compare", words(given, options, tmp_path)) == 0
    warned = [line for line in capsys.readouterr().err.splitlines() if "load_cell.zero" in line]
    assert len(warned) == told
    assert all(part in line for line in warned for part in ("recording.yaml", " N ", "zero: start"))


def test_a_response_of_another_design_is_refused(
    study: list[str], film: xr.Dataset, tmp_path: Path, failing: Failing
) -> None:
    path = study[study.index("--design") + 1]
    other = datasets.read(path, "design")
    attributes = {name: str(other.attrs[name]) for name in ("problem", "problem_hash", "parents")}
    datasets.write(other.assign(overlaps=1), tmp_path / "design.nc", "design", attributes)
    given = [str(tmp_path / "design.nc") if word == path else word for word in study]
    told = failing("compare", words(given, written(film, tmp_path), tmp_path))
    assert "that of another design" in told


def test_curves_are_those_of_both_sides(whole: xr.Dataset) -> None:
    turn = whole["mean_rotation"].sel(estimate="value").values
    np.testing.assert_allclose(turn[0], turn[2], atol=3 * SIGMA[2])
    np.testing.assert_allclose(turn[1], turn[2], atol=3 * SIGMA[2])
    assert turn[2].max() > 10 * SIGMA[2]
    peaks = whole["peak_to_peak"].sel(estimate="value").where(whole["use"] == 0)
    np.testing.assert_allclose(peaks.sel(source="measured"), peaks.sel(source="nominal"), atol=0.03)


@pytest.mark.parametrize("share", [0.0, 0.8], ids=["all seen", "some seldom"])
def test_curves_are_over_the_units_of_interest_that_were_seen(
    study: list[str], film: xr.Dataset, tmp_path: Path, share: float
) -> None:
    """Count held and driven units too, as the study does; leave out those seen seldom."""
    roi = datasets.read(study[study.index("--response") + 1], "response")["roi"].values == 1
    seldom = np.isin(np.arange(len(roi)), np.flatnonzero(roi)[::3])
    hidden = seldom & (np.arange(len(TIME))[:, None] < share * len(TIME))
    motion = np.where(hidden[..., None], np.nan, film["displacement"].values)
    made = film.assign(displacement=(film["displacement"].dims, motion))
    assert run_stage("compare", words(study, written(made, tmp_path), tmp_path)) == 0
    told = datasets.read(tmp_path / "comparison.nc", "comparison")
    assert (told["use"].values[roi] == 1).any()
    kept = told["nominal"].isel(unit=roi & ~(seldom & (share > 0)))
    turned = abs(kept.sel(dof="theta")).mean("unit")
    found = told["mean_rotation"].sel(source="nominal", estimate="value")
    np.testing.assert_allclose(found, turned, rtol=1e-5)


def test_the_same_files_give_the_same_bytes(
    study: list[str], film: xr.Dataset, folder: Path, tmp_path: Path
) -> None:
    assert run_stage("compare", words(study, written(film, tmp_path), tmp_path)) == 0
    name = "comparison.nc"
    assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_a_turn_of_the_camera_is_taken_out_a_scale_not(study: list[str], film: xr.Dataset) -> None:
    turn, scale = 0.01, 1.002
    cos, sin = np.cos(turn), np.sin(turn)
    matrix = np.array([[cos, sin], [-sin, cos]])  # of rows
    motion = film["displacement"].values.copy()
    motion[..., :2] = scale * motion[..., :2] @ matrix
    centre = film["vertices"].mean("vertex").values
    middle = np.nanmean(centre, axis=0)
    missed = (scale * (centre - middle) @ matrix + middle - centre) / PIXEL
    tilted = film.assign(
        displacement=(film["displacement"].dims, motion), camera_residual=(("unit", "xy"), missed)
    )
    found = prepare_measurement(tilted, datasets.read(study[study.index("--design") + 1], "design"))
    assert found.registration.rotation == pytest.approx(turn, abs=1e-4)
    assert found.registration.scale == pytest.approx(scale, abs=1e-4)
    assert pixel_size(tilted, middle) == pytest.approx(PIXEL)
    upright = film["displacement"].values[..., :2]
    np.testing.assert_allclose(found.displacement[..., :2], scale * upright, atol=1e-3)


def _hiding_the_drive(film: xr.Dataset) -> xr.Dataset:
    return film.assign(displacement=film["displacement"].where(film["i"] < film["i"].max()))


@pytest.mark.parametrize(
    ("change", "more", "told"),
    [
        (lambda film: film.isel(unit=slice(1, None)), "", "not of this study's design: it has 24"),
        (lambda film: film, "structure: intact\n", "other units are absent"),
        (lambda film: film.assign(vertices=film["vertices"] + 0.7), "", "up to 0.70 mm apart"),
        (lambda film: film.isel(time=slice(0, 6)), "", "too few frames"),
        (_hiding_the_drive, "", "no driven unit is seen"),
        (lambda film: film.assign(displacement=-film["displacement"]), "", "cannot be aligned"),
        (lambda film: film, "case: 3\n", "no such load case"),
    ],
    ids=["units", "void", "vertices", "frames", "drive", "direction", "case"],
)
def test_what_does_not_belong_together_is_refused(
    study: list[str], film: xr.Dataset, tmp_path: Path, failing: Failing,
    change: Change, more: str, told: str,
) -> None:  # fmt: skip
    options = written(change(film), tmp_path, more)
    assert told in failing("compare", words(study, options, tmp_path))
