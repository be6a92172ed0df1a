from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets, problem
from pipeline.__main__ import run_stage
from pipeline.datasets import chunked
from pipeline.posing import scene_of, setting_losses
from pipeline.problem.sections import Setting, Sweep, sweep_cases
from pipeline.runtime import CaseLog, SweepResult, UserError, case_log
from sim.scene import Evaluator, make_plan
from tests.pipeline import static, unchanged
from tests.tables import cases

GRID = """sweep:
  grid:
    cloak.disc.radius: [22 mm, 20 mm, 500 mm]
    material.bending_stiffness: { from: 1 N mm/rad, to: 2 N mm/rad, points: 2 }
"""
RANDOM = """sweep:
  random:
    drive.amplitude: { from: 1 mm, to: 2 mm }
    material.bending_stiffness: { mean: 1.5 N mm/rad, deviation: 0.1 N mm/rad }
    cloak.disc.radius: { from: 15 mm, to: 25 mm }
  samples: 3
"""


def folder_of(path: Path, more: str) -> Path:
    unchanged.write(static.write(path, static.HOLE + more, size=5, amplitude=2.0))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small study with a hole and a grid of parameters."""
    return folder_of(tmp_path_factory.mktemp("hole"), GRID)


@pytest.fixture(scope="module")
def whole(folder: Path) -> xr.Dataset:
    return unchanged.chunk("sweep", "sweep", folder, folder / "sweep.nc", (0, 1))


def test_the_first_key_of_a_grid_varies_fastest(whole: xr.Dataset) -> None:
    assert list(whole["parameter"].values) == ["cloak.disc.radius", "material.bending_stiffness"]
    assert list(whole["parameter_units"].values) == ["mm", "N mm/rad"]
    expected = [[22, 1], [20, 1], [500, 1], [22, 2], [20, 2], [500, 2]]
    np.testing.assert_array_equal(whole["value"], expected)


def test_a_case_has_its_setting_or_says_why_it_failed(folder: Path, whole: xr.Dataset) -> None:
    path = folder / "other" / "problem.yaml"
    path.parent.mkdir()
    text = (folder / "problem.yaml").read_text().partition("sweep:")[0]
    path.write_text(text.replace("bending_stiffness: 1.5", "bending_stiffness: 2"))
    scene = scene_of(problem.load(path), folder)
    loss, _, _ = Evaluator(scene, make_plan(scene))(np.zeros(scene.space.n_variables))
    assert float(whole["loss_altered"][3]) == pytest.approx(loss, rel=1e-9)
    assert float(whole["loss"][3]) == pytest.approx(loss, rel=1e-9)  # of a design without a change
    fine = [True, True, False, True, True, False]
    assert (whole["status"].values == "ok").tolist() == fine
    assert np.isfinite(whole["loss"].values).tolist() == fine
    assert all("cloak" in reason for reason in whole["status"].values[[2, 5]])


@pytest.mark.usefixtures("whole")
def test_parts_join_to_the_whole(folder: Path, tmp_path: Path) -> None:
    made = unchanged.joined("sweep", "sweep", folder, tmp_path / "sweep.nc", 4)
    assert made == (folder / "sweep.nc").read_bytes()


def test_a_killed_sweep_goes_on(
    folder: Path, whole: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "sweep.nc"
    (begun,) = folder.glob(".journal/sweep_*/part_0.csv")
    kept = tmp_path / ".journal" / begun.parent.name / "part_0.csv"
    kept.parent.mkdir(parents=True)
    kept.write_bytes(begun.read_bytes()[: begun.read_bytes().index(b"\n3,") + 9])
    assert sorted(case_log.known(kept.parent)) == [0, 1, 2]
    simulated = []
    results = setting_losses.results

    def counted(*given: object) -> tuple[list[SweepResult], tuple[float, ...]]:
        simulated.append(given)
        return results(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(setting_losses, "results", counted)
    xr.testing.assert_identical(unchanged.chunk("sweep", "sweep", folder, out, (0, 1)), whole)
    assert len(simulated) == 3
    assert out.read_bytes() == (folder / "sweep.nc").read_bytes()
    assert kept.read_bytes() == begun.read_bytes()


def test_results_are_read_while_they_come(tmp_path: Path) -> None:
    path = tmp_path / "part_0.csv"
    with CaseLog(path, ["drive.amplitude"]) as book:
        book.add([(7, ["2 mm"], SweepResult(0.1, 1 / 3, -0.2))])
        book.add([(8, ["3 mm"], SweepResult.failed("no\nequilibrium"))])
        found = case_log.known(tmp_path)
    assert found[7] == SweepResult(0.1, 1 / 3, -0.2)
    assert np.isnan(found[8].loss)
    assert found[8].status == "no equilibrium"


def test_random_cases_do_not_depend_on_their_number(tmp_path: Path) -> None:
    few = problem.load(static.write(tmp_path, static.HOLE + RANDOM)).sweep
    assert few is not None
    many = few.model_copy(update={"samples": 50})
    drawn = list(sweep_cases.list_settings(many))
    assert list(sweep_cases.list_settings(few)) == drawn[:3]
    values = np.array([[float(str(word).split()[0]) for word in case.values()] for case in drawn])
    assert len(np.unique(values[:, 0])) == 50
    assert ((values[:, 0] > 1) & (values[:, 0] < 2)).all()
    assert abs(values[:, 1].mean() - 1.5) < 0.05


def test_values_side_by_side() -> None:
    wanted = Sweep.model_validate({"list": {"a.b": ["1 mm", "2 mm"], "c": ["x", "y"]}})
    listed = [{"a.b": "1 mm", "c": "x"}, {"a.b": "2 mm", "c": "y"}]
    assert list(sweep_cases.list_settings(wanted)) == listed
    assert sweep_cases.parameter_unit(wanted, "c") == "1"
    grid = {"drive.directions": ["0 deg", "90 deg"], "drive.frequency": ["2 Hz", "3 Hz", "4 Hz"]}
    wanted = Sweep.model_validate({"grid": grid})
    parts = [sweep_cases.select_groups(wanted, k, 2) for k in range(2)]
    numbers = [group.numbers for part in parts for group in part]
    assert numbers == [range(2), range(2, 4), range(4, 6)]
    together = {"drive.directions": ["0 deg", "90 deg"], "drive.frequency": "3 Hz"}
    assert parts[1][0].together == together


def test_a_setting_that_makes_no_problem_is_told(folder: Path) -> None:
    asked = problem.load(folder / "problem.yaml")
    design = datasets.read(folder / "design.nc", "design")
    moved: Setting = {"void.disc.centre": ["45 mm", "30 mm"]}
    listed: list[tuple[Setting, str]] = [
        ({"cloak.disc.radius": "500 mm"}, "cloak"),
        ({"lattice.columns": 7}, "of another lattice"),
        ({"lattice.bias_angle": "25 deg"}, "of another lattice"),
        (moved, "lacks units"),
        ({"drive.amplitude": "-1 mm"}, "greater than zero"),
    ]
    for setting, why in listed:
        with pytest.raises(setting_losses.UnposedError, match=why):
            setting_losses.results(asked, setting, folder, design, 1)


@cases("stages", "text, why")
def test_a_faulty_sweep_is_told(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(UserError, match=why):
        problem.load(static.write(tmp_path, static.HOLE + text))


MEASURED = "report: { measured_constants: { file: constants.csv, samples: 2 } }\n"
DRAWS = "# three samples\naxial_stiffness (N/mm),shear_stiffness (N/m),bending_stiffness (N mm)\n"


def test_measured_constants_are_set_draw_by_draw(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, MEASURED)
    (folder / "constants.csv").write_text(f"{DRAWS}120,1190,1.5\n1,1,1\n240,2380,3\n")
    words = ["--problem", str(folder / "problem.yaml"), "--design", str(folder / "design.nc")]
    out = folder / "constants.nc"
    assert run_stage("sweep", ["constants", *words, "--out", str(out)]) == 0
    made = datasets.read(out, "sweep")
    np.testing.assert_allclose(made["value"], [[120, 1.19, 1.5], [240, 2.38, 3.0]])
    # Motions depend on ratios of stiffness alone.
    assert (made["status"] == "ok").all()
    np.testing.assert_allclose(made["loss"][1], made["loss"][0], rtol=1e-6)
    asked = problem.load(folder / "problem.yaml")
    posed = problem.over_measured_constants(asked, folder)
    assert made.attrs["problem_hash"] == problem.section_hash(posed, "sweep")


@pytest.mark.parametrize(
    ("line", "told"), [("", "only 1 lines"), ("1,-1,1\n", "a stiffness is not positive")]
)
def test_faulty_measured_constants_are_refused(line: str, told: str, tmp_path: Path) -> None:
    path = static.write(tmp_path, static.HOLE + MEASURED, size=5)
    (tmp_path / "constants.csv").write_text(f"{DRAWS}120,1190,1.5\n{line}")
    with pytest.raises(UserError, match=told):
        problem.over_measured_constants(problem.load(path), tmp_path)


def test_a_structure_that_cannot_rest_fails_its_case_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def restless(*_: object) -> None:
        raise UserError("the structure comes to no rest")

    monkeypatch.setattr(setting_losses, "structures_of", restless)
    asked = problem.load(folder / "problem.yaml")
    design = datasets.read(folder / "design.nc", "design")
    with pytest.raises(setting_losses.UnposedError, match="no rest"):
        setting_losses.results(asked, {"drive.amplitude": "1 mm"}, folder, design, 1)


def test_parts_keep_their_units_and_are_there_once(whole: xr.Dataset, tmp_path: Path) -> None:
    parts = [tmp_path / "sweep_0.nc", tmp_path / "sweep_1.nc"]
    for path, some in zip(parts, (slice(0, 3), slice(3, None)), strict=True):
        part = whole.isel(case=some)
        part["loss"].attrs["units"] = "N mm"
        datasets.write(part, path, "sweep", dict(whole.attrs))
    chunked.join_parts(parts, "sweep", "case", tmp_path / "sweep.nc")
    assert datasets.read(tmp_path / "sweep.nc", "sweep")["loss"].attrs["units"] == "N mm"
    with pytest.raises(UserError, match="twice"):
        chunked.join_parts([*parts, parts[0]], "sweep", "case", tmp_path / "sweep.nc")
    datasets.write(
        whole.isel(case=[5]), parts[1], "sweep", whole.attrs | {"problem_hash": "0" * 16}
    )
    with pytest.raises(UserError, match="another problem"):
        chunked.join_parts(parts, "sweep", "case", tmp_path / "sweep.nc")
