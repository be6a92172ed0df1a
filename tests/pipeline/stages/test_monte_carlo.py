from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets, problem
from pipeline.__main__ import run_stage
from pipeline.posing import perturbed, scene_of
from pipeline.posing.perturbed import noises, simulate
from pipeline.stages import verify
from sim.core import SimulationError
from sim.solvers import batch, solve_case
from tests.pipeline import static, unchanged
from tests.pipeline.conftest import Failing

MORE = "robustness: { samples: 4, geometry: [0.05], stiffness: [0.1], seed: 3 }\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small study with a hole, and the design that changes nothing."""
    folder = tmp_path_factory.mktemp("hole")
    path = static.write(folder, static.HOLE + MORE, size=5, amplitude=3.0)
    unchanged.write(path)
    return folder


@pytest.fixture(scope="module")
def whole(folder: Path) -> xr.Dataset:
    return unchanged.chunk("monte_carlo", "scatter", folder, folder / "scatter.nc", (0, 1))


def test_every_copy_is_another_one(whole: xr.Dataset) -> None:
    noises = ["geometry 5 %", "stiffness 10 %", "together 0.1 mm, 10 %"]
    assert list(whole["noise"].values) == [*noises, "vertices 0.1 mm", "common 10 %"]
    assert (whole["status"] == "ok").all()
    assert len(np.unique(whole["loss"])) == 20
    np.testing.assert_allclose(whole["time"], [0.25, 0.5, 0.75, 1.0])


@pytest.mark.usefixtures("whole")
def test_parts_join_to_the_whole(folder: Path, tmp_path: Path) -> None:
    made = unchanged.joined("monte_carlo", "scatter", folder, tmp_path / "scatter.nc", 2)
    assert made == (folder / "scatter.nc").read_bytes()


def test_without_noise_every_copy_is_the_design(folder: Path) -> None:
    asked = problem.load(folder / "problem.yaml")
    assert asked.robustness is not None
    nothing = {"geometry": (0.0,), "stiffness": (0.0,), "together": None}
    none = asked.robustness.model_copy(update=nothing)
    scene = scene_of(asked, folder)
    made = simulate(scene, scene.lattice.vertices, none, [0, 1], 1)
    checked = verify.checks(asked, folder, datasets.read(folder / "design.nc", "design"))
    as_run = checked["loss"].sel(check="as run", structure="cloaked")
    np.testing.assert_allclose(made["loss"], float(as_run), rtol=1e-9)


def test_a_copy_that_fails_keeps_its_reason(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def failing(*given: object) -> object:
        calls.append(given)
        if len(calls) == 2:
            raise SimulationError("no equilibrium found beyond load 3 of 4")
        return solve_case(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(batch, "solve_case", failing)
    asked = problem.load(folder / "problem.yaml")
    assert asked.robustness is not None
    scene = scene_of(asked, folder)
    made = simulate(scene, scene.lattice.vertices, asked.robustness, [0, 1, 2], 1)
    first = made.sel(noise=noises(asked.robustness, 15.0)[0].name)
    assert list(first["status"].values) == ["ok", "no equilibrium found beyond load 3 of 4", "ok"]
    assert np.isnan(first["loss"].values).tolist() == [False, True, False]


def test_a_problem_without_copies_is_told(folder: Path, tmp_path: Path, failing: Failing) -> None:
    path = static.write(tmp_path, static.HOLE, size=5, amplitude=3.0)
    words = ["--design", str(folder / "design.nc"), "--chunk", "0", "--chunks", "1"]
    out = ["--out", str(tmp_path / "scatter.nc")]
    assert "robustness" in failing("monte_carlo", ["run", "--problem", str(path), *words, *out])


def test_strain_energies_have_their_unit(tmp_path: Path) -> None:
    energy = static.HOLE.replace("displacement, target: intact", "strain_energy, target: rest")
    path = static.write(tmp_path, energy + MORE, size=5, amplitude=3.0)
    unchanged.write(path)
    made = unchanged.chunk("monte_carlo", "scatter", tmp_path, tmp_path / "scatter.nc", (0, 4))
    assert made["loss"].attrs["units"] == "N mm"


@pytest.mark.parametrize(
    ("of", "key"), [(("0", "5"), "--chunks"), (("4", "4"), "--chunk"), (("-1", "4"), "--chunk")]
)
def test_parts_that_would_be_empty_are_refused(
    folder: Path, tmp_path: Path, failing: Failing, of: tuple[str, str], key: str
) -> None:
    words = ["--problem", str(folder / "problem.yaml"), "--design", str(folder / "design.nc")]
    words += ["--chunk", of[0], "--chunks", of[1], "--out", str(tmp_path / "scatter.nc")]
    assert f"key:    {key}\n" in failing("monte_carlo", ["run", *words])


@pytest.mark.parametrize(
    ("name", "structure"), [("target_motion", "intact"), ("make_plan", "cloaked")]
)
def test_a_design_that_cannot_be_simulated_is_told(
    folder: Path, tmp_path: Path, failing: Failing, monkeypatch: pytest.MonkeyPatch,
    name: str, structure: str,
) -> None:  # fmt: skip
    def stopped(*_: object, **__: object) -> None:
        raise SimulationError("no equilibrium found")

    monkeypatch.setattr(perturbed, name, stopped)
    words = ["--problem", str(folder / "problem.yaml"), "--design", str(folder / "design.nc")]
    words += ["--chunk", "0", "--chunks", "4", "--out", str(tmp_path / "scatter.nc")]
    assert f"the {structure} structure cannot be" in failing("monte_carlo", ["run", *words])


def test_finer_load_steps_pass_the_same_states(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "verification.nc"
    words = ["--problem", str(folder / "problem.yaml"), "--design", str(folder / "design.nc")]
    assert run_stage("verify", [*words, "--out", str(out)]) == 0
    made = datasets.read(out, "verification")
    assert list(made["check"].values)[:3] == ["as run", "2 x load steps", "10 x load steps"]
    finer = made.isel(check=slice(0, 3))
    assert float(finer["departure"].max()) < 1e-6
    loss = finer["loss"].sel(structure="cloaked")
    assert abs(float(loss[2] / loss[0]) - 1) < 0.2
    assert (finer["unstable"] == 0).all()
