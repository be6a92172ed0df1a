from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline import datasets, problem
from pipeline.__main__ import run_stage
from pipeline.posing import law_comparison
from pipeline.problem.sections import Method
from tests.pipeline.conftest import Failing
from tests.pipeline.static import GEOMETRIC as BUDGET


@pytest.fixture(scope="module")
def study(hole: list[str]) -> Path:
    """Folder of a problem with design.nc and response.nc."""
    folder = Path(hole[1]).parent
    shipped, response = str(folder / "design.nc"), str(folder / "response.nc")
    assert run_stage("simulate", [*hole, response, "--design", shipped]) == 0
    return folder


def reconsidered(study: Path, out: Path, factor: float) -> tuple[xr.Dataset, xr.Dataset]:
    """The second design, were the cloak's loss with contact on distance so many times larger."""
    response = datasets.read(study / "response.nc", "response")
    cloak = {"structure": "cloaked", "contact_law": "geometric"}
    response["loss_by_contact"].loc[cloak] *= factor
    told, second, moved = out / "told.nc", out / "second.nc", out / "moved.nc"
    datasets.write(response, told, "response", response.attrs)
    options = ["--problem", str(study / "problem.yaml"), "--quiet", "--out"]
    first = ["--design", str(study / "design.nc"), "--response", str(told)]
    assert run_stage("redesign", [*options, str(second), *first]) == 0
    with_distance_contact = [*options, str(moved), "--design", str(second), "--geometric"]
    assert run_stage("simulate", with_distance_contact) == 0
    return datasets.read(second, "design"), datasets.read(moved, "response")


def test_a_design_on_which_both_laws_agree_is_kept_others_not(study: Path, tmp_path: Path) -> None:
    first = datasets.read(study / "design.nc", "design")
    second, moved = reconsidered(study, tmp_path, 1.09)
    np.testing.assert_allclose(second["vertices"], first["vertices"], atol=1e-12)
    assert second.sizes["evaluation"] == 1
    angle, distance = law_comparison.cloak_losses(moved, (1.0,))
    assert distance == pytest.approx(moved["loss"].sel(structure="cloaked").item(), rel=1e-9)
    assert distance == pytest.approx(angle, rel=1e-9)
    second, moved = reconsidered(study, tmp_path, 1.11)
    losses = second["loss"].values[0]
    assert len(losses) == BUDGET
    assert losses[0] == pytest.approx(float(first["best_loss"][0]), rel=1e-6)
    assert float(second["best_loss"][0]) < losses[0]
    assert moved["loss"].sel(structure="cloaked").item() == pytest.approx(losses.min(), rel=1e-6)
    assert moved["overlaps"].sel(structure="cloaked").item() == 0


def test_a_design_that_cannot_be_simulated_is_begun_anew(study: Path, tmp_path: Path) -> None:
    second, moved = reconsidered(study, tmp_path, np.nan)
    altered = moved["loss"].sel(structure="altered").item()
    assert float(second["loss"][0, 0]) == pytest.approx(altered, rel=1e-6)


def changed(study: Path, folder: Path, optimiser: str) -> list[str]:
    """Words for another problem of the study's design and response."""
    text = (study / "problem.yaml").read_text(encoding="utf-8")
    path = folder / "problem.yaml"
    path.write_text(text.replace("optimiser: {", f"optimiser: {{ {optimiser},"), encoding="utf-8")
    made = ["--design", str(study / "design.nc"), "--out", str(folder / "made.nc")]
    return ["--problem", str(path), "--quiet", *made]


def test_a_design_made_without_turning_slots_is_taken_as_it_is(study: Path, tmp_path: Path) -> None:
    words = changed(study, tmp_path, "as_built: true")
    assert run_stage("redesign", [*words, "--response", str(study / "response.nc")]) == 0
    second = datasets.read(tmp_path / "made.nc", "design")
    first = datasets.read(study / "design.nc", "design")
    np.testing.assert_allclose(second["vertices"], first["vertices"], atol=1e-9)
    np.testing.assert_allclose(second["end_angles"].fillna(0.0), 0.0, atol=1e-9)


def test_a_symmetry_that_the_lattice_has_not_is_told(
    study: Path, tmp_path: Path, failing: Failing
) -> None:
    words = changed(study, tmp_path, "symmetry: mirror_y")
    for stage, more in (("simulate", []), ("redesign", ["--response", study / "response.nc"])):
        assert "key:    optimiser.symmetry" in failing(stage, [*words, *map(str, more)])


def test_the_budget_enters_the_hash_of_this_stage_only(study: Path) -> None:
    asked = problem.load(study / "problem.yaml")
    other = asked.with_optimiser(geometric=Method(evaluations=9))
    assert problem.section_hash(other, "design") == problem.section_hash(asked, "design")
    assert problem.section_hash(other, "redesign") != problem.section_hash(asked, "redesign")
