from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets
from pipeline.calibration import study_cycles, study_pictures
from pipeline.calibration.inputs import KnownPictures, LoadCycles, Population
from pipeline.datasets import provenance
from pipeline.datasets.tables import TABLES
from pipeline.problem.reading import load_section
from pipeline.runtime import ROOT, UserError
from reports.__main__ import main
from reports.base import style
from reports.products.validation.figures import COLOURS, draw_samples
from reports.products.validation.pictures import (
    error_table,
    picture_facts,
    pictures_of_frames,
)
from reports.products.validation.validation_report import (
    averaged_cycles,
    cycle_table,
    prediction_errors,
    relative_error,
)
from tests.reports.conftest import Failing

FOLDER = ROOT / "experiments/validation"
SIZES = {"quantile": 3, "sample": 3, "test": 3, "point": 6, "predicted": 4}
CONSTANTS = ["axial_stiffness", "shear_stiffness", "bending_stiffness"]
TESTS = ["tension", "compression", "shear"]
NAMES = {
    "constant": CONSTANTS,
    "with_constant": CONSTANTS,
    "sample": ["s1", "s2", "s3"],
    "test": TESTS,
    "curve": [f"{test}_s{k}" for test in TESTS for k in (1, 2)],
    "left_out_curve": ["shear_s1", "shear_s2"],
    "without": ["s1", "shear"],
}


def made_up() -> xr.Dataset:
    """Numbers of no meaning in the form of a population, but for the prediction."""
    random = np.random.default_rng(0)
    variables = {}
    for name, variable in TABLES["population"].items():
        shape = [SIZES.get(dim, len(NAMES.get(dim, "ab"))) for dim in variable.dims]
        values = random.uniform(0.5, 1.5, shape)
        if variable.dtype == "str":
            values = np.array(NAMES.get(name, ["one", "two"]))
        elif variable.dtype != "float64":
            values = np.ones(shape, variable.dtype)
        variables[name] = (variable.dims, values)
    variables["displacement"] = (("predicted",), np.arange(1.0, 5.0))
    variables["factor"] = (("factor",), np.array([0.5, 2.0]))
    force = np.array([4.0, 8.0, 12.0, 16.0])
    for name, factor in (("measured", 1.0), ("median", 0.9), ("low", 0.6), ("high", 1.4)):
        variables[name] = (("predicted",), factor * force)
    return xr.Dataset(variables).set_coords(["constant", "sample", "test"])


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("validation")
    cycles = load_section(FOLDER / "morpher.yaml", LoadCycles)
    pictures = load_section(FOLDER / "pictures.yaml", KnownPictures)
    for name, kind, data, asked in (
        ("hinges", "population", made_up(), load_section(FOLDER / "hinges.yaml", Population)),
        ("morpher", "load_cycles", study_cycles(cycles, FOLDER), cycles),
        ("pictures", "pictures", study_pictures(pictures, FOLDER), pictures),
    ):
        told = asked.model_dump_json()
        origin = provenance.of_recording(told, {}, synthetic=False, role=kind)
        datasets.write(data, folder / f"{name}.nc", kind, origin)  # type: ignore[arg-type]
    words = ["--samples", folder / "hinges.nc", "--cycles", folder / "morpher.nc"]
    words += ["--pictures", folder / "pictures.nc", "--folder", FOLDER]
    assert main(["validation", *map(str, words), "--out-dir", str(folder), "--quiet"]) == 0
    assert (Path(folder) / "prediction.pdf").stat().st_size > 10_000
    alone = [*words[:2], "--out-dir", folder / "alone", "--quiet"]
    assert main(["validation", *map(str, alone)]) == 0
    assert "Load cycles" not in (folder / "alone/index.html").read_text()
    return (folder / "index.html").read_text()


@pytest.mark.slow
def test_it_says_who_measured_and_nothing_is_called_synthetic(page: str) -> None:
    assert page.count("Measured at: Bertoldi Group, Harvard University") == 3
    assert page.count("Licence: MIT") == 3
    assert page.count("Licence: BSD 3-clause") == 1
    assert "SYNTHETIC" not in page


def test_a_page_of_nothing_is_refused(tmp_path: Path, failing: Failing) -> None:
    told = failing("validation", tmp_path / "page")
    assert "give --samples, --cycles or --pictures" in told


@pytest.mark.slow
def test_it_tells_the_errors_and_their_sign(page: str) -> None:
    assert "4.41 mm, -6.68 N to 5.05 mm, -0.07 N" in page
    assert page.count("not simulated") == 2
    assert "340 of 384 units are found" in page
    assert "The motion by DICe is good to some 0.03 px and 0.002 rad" in page
    assert "all parts agree with it within that" in page
    assert "the median is below the measured force everywhere" in page
    rms = 100 * np.sqrt((relative_error(made_up(), "median") ** 2).mean())
    assert f"<strong>{rms:.1f} %</strong><span>error of the median" in page


def test_errors_are_told_where_the_curve_was_measured() -> None:
    made = made_up().assign(displacement=("predicted", np.array([0.2, 0.4, 1.0, 2.0])))
    table = prediction_errors(made)
    heads = ["at 0.2 mm", "at 0.4 mm", "at 1 mm", "at 2 mm"]
    assert table.columns == ["Prediction", "rms", *heads, "Band at the end"]
    error = 100 * relative_error(made, "median")
    assert table.rows[0][2:-1] == [f"{value:+.1f} %" for value in error]


def test_a_simulated_curve_tells_nothing_beyond_its_ends() -> None:
    force = made_up()["measured"].values
    made = made_up().assign(simulated=("predicted", np.append(1.1 * force[:-1], np.nan)))
    *_, row = prediction_errors(made).rows
    error = 0.1 * force[:-1] / force.max()
    rms = 100 * np.sqrt(np.mean(error**2))
    assert row[1:-1] == [f"{rms:.1f} %", *(f"{100 * value:+.1f} %" for value in error), "none"]


def test_points_are_of_samples_whatever_their_names() -> None:
    """Holds for labels with an underscore, of which the mean over both is none."""
    curves = [f"shear_{name}" for name in ("run_1", "run_2", "run_1+run_2")]
    others = [f"{test}_run_{k}" for k, test in enumerate(TESTS, 1)]
    made = made_up().assign(curve=("point", [*curves, *others]))
    made = made.assign_coords(sample=["run_1", "run_2", "run_3"])
    panel = draw_samples(made).axes[TESTS.index("shear")]
    points = panel.get_lines()[:4]
    labels = [f"sample run_{k}" for k in (1, 2)]
    assert [each.get_label() for each in points] == [*labels, "mean", "sample run_3"]
    assert [each.get_color() for each in points] == [*COLOURS[:2], style.INTACT, COLOURS[2]]


def cycled(folder: Path, counts: Sequence[int]) -> tuple[LoadCycles, xr.Dataset]:
    """Records so many cycles each, to 2 mm and back, without equilibria beside them."""
    asked = load_section(FOLDER / "morpher.yaml", LoadCycles)
    records = []
    for k, count in enumerate(counts):
        way = np.concatenate([np.linspace(0, 2, 41), np.linspace(2, 0, 41)[1:]] * count)
        lines = "\n".join(f"{x},{3 * x}" for x in way)
        (folder / f"{k}.csv").write_text(f"approach (mm),tension (N)\n{lines}\n")
        named = {"name": f"r{k}", "title": f"record {k}", "file": str(folder / f"{k}.csv")}
        records.append(asked.records[2].model_copy(update=named))
    asked = asked.model_copy(update={"records": tuple(records)})
    return asked, study_cycles(asked, folder)


@pytest.mark.parametrize(
    ("counts", "told"),
    [
        ([3, 2], "the cycles without the first"),
        ([3, 1], "the cycles without the first (with it: record 1)"),
        ([1], "all cycles"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_lone_cycle_is_told_as_such(counts: list[int], told: str, tmp_path: Path) -> None:
    made = cycled(tmp_path, counts)[1]
    assert averaged_cycles(made) == told
    loops = [row[2] for row in cycle_table(made).rows]
    assert [", " in each for each in loops] == [count > 1 for count in counts]


def test_cycles_are_drawn_of_many_records_and_linked_where_they_are(tmp_path: Path) -> None:
    asked, made = cycled(tmp_path, [1] * 9)
    origin = provenance.of_recording(
        asked.model_dump_json(), {}, synthetic=False, role="load_cycles"
    )
    datasets.write(made, tmp_path / "one.nc", "load_cycles", origin)
    words = ["--cycles", str(tmp_path / "one.nc"), "--out-dir", str(tmp_path / "page/here")]
    assert main(["validation", *words, "--quiet"]) == 0
    page = (tmp_path / "page/here/index.html").read_text()
    assert 'href="../../one.nc"' in page
    assert "Mean over all cycles, grey" in page


def tracked() -> xr.Dataset:
    """Makes motions of three parts in two pictures, which agree within 0.01 px and rad."""
    known = np.ones((3, 2, 3))
    motions = {"reference": known, "measured": known + np.array([0.01, 0.01, 0.001])}
    return xr.Dataset(
        {name: (("part", "frame", "dof"), each) for name, each in motions.items()}
        | {"seen": ("unit", [1, 0]), "pixel_size": 0.5},
        {"part": list("abc"), "frame": [1, 2], "dof": ["ux", "uy", "theta"]},
    )


@pytest.mark.filterwarnings("error")
def test_what_the_other_program_does_not_tell_is_no_fault_of_the_tracker() -> None:
    asked, made = load_section(FOLDER / "pictures.yaml", KnownPictures), tracked()
    whole, facts = error_table(made).rows, picture_facts(made, asked)
    assert (facts["missed_parts"], facts["judged"], facts["within"]) == (0, True, True)
    made["reference"][1, 0] = made["measured"][1, 0] = np.nan
    assert (error_table(made).rows, picture_facts(made, asked)) == (whole, facts)
    made["measured"][0, 1] = np.nan
    assert picture_facts(made, asked) == {**facts, "missed_parts": 1}
    made["reference"][2] = np.nan
    assert error_table(made).rows[2][1:] == ["in no picture of both", "", "", ""]
    assert picture_facts(made, asked)["within"]
    made["measured"][0, 0, 0] += 1.0
    assert not picture_facts(made, asked)["within"]


def test_agreement_is_judged_by_what_the_other_program_is_good_to() -> None:
    asked, made = load_section(FOLDER / "pictures.yaml", KnownPictures), tracked()
    for accuracy, judged, within in (((0.005, 0.002), True, False), (None, False, True)):
        parts = asked.rigid_parts.model_copy(update={"accuracy": accuracy})
        facts = picture_facts(made, asked.model_copy(update={"rigid_parts": parts}))
        assert (facts["judged"], facts["within"]) == (judged, within)


def test_pictures_are_those_of_the_frames(tmp_path: Path) -> None:
    for number in (1, 11, 21):
        (tmp_path / f"frame_{number:04}.png").touch()
    found = pictures_of_frames(tmp_path, [1, 21])
    assert [path.name for path in found] == ["frame_0001.png", "frame_0021.png"]
    with pytest.raises(UserError, match="no picture of a frame"):
        pictures_of_frames(tmp_path, [2])
