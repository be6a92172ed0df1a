import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pipeline.__main__ import run_stage
from pipeline.runtime import ROOT
from reports.__main__ import main
from tests.e2e.stages import Built, build, build_verification

PROBLEM = ROOT / "experiments/fig7/problem.yaml"
START, END = 0.092842, 0.036388


@dataclass(frozen=True)
class Wave:
    """What the stages made, and the folder of the report."""

    built: Built
    verification: xr.Dataset
    page: Path


@pytest.fixture(scope="module")
def wave(tmp_path_factory: pytest.TempPathFactory) -> Wave:
    """The draft of Figure 7."""
    folder = tmp_path_factory.mktemp("fig7")
    built = build(PROBLEM, "quick", folder)
    study = ["--problem", str(PROBLEM), "--preset", "quick", "--quiet"]
    kinds = ("design", "response", "scatter", "verification")
    files = {name: folder / f"{name}.nc" for name in kinds}
    copies = [*study, "--design", str(files["design"]), "--out", str(files["scatter"])]
    assert run_stage("monte_carlo", ["run", *copies, "--chunk", "0", "--chunks", "1"]) == 0
    found = build_verification(PROBLEM, "quick", folder)
    given = [word for name, file in files.items() for word in (f"--{name}", str(file))]
    assert main(["study", *study, *given, "--out-dir", str(folder / "report")]) == 0
    return Wave(built, found, folder / "report")


def test_the_losses_are_the_known_ones(wave: Wave) -> None:
    loss = wave.built.response["loss"].isel(case=0)
    assert float(loss.sel(structure="altered")) == pytest.approx(START, rel=1e-3)
    assert float(loss.sel(structure="cloaked")) == pytest.approx(END, rel=0.02)
    assert float(loss.sel(structure="cloaked")) == pytest.approx(wave.built.best_loss, rel=1e-4)
    assert float(wave.built.design["constraint_margin"].min()) >= 0.0


def test_shorter_steps_confirm_them(wave: Wave) -> None:
    found = wave.verification
    assert (found["status"].isel(check=slice(3)) == "ok").all()
    steps = found["time_step"].isel(check=slice(3))
    np.testing.assert_allclose(steps / steps[0], [[1.0] * 3, [0.5] * 3, [0.25] * 3])
    for name in ("altered", "cloaked"):
        by_step = found["loss"].sel(structure=name).isel(check=slice(3)).values
        np.testing.assert_allclose(by_step, by_step[-1], rtol=1e-3)
        run = wave.built.response["loss"].isel(case=0).sel(structure=name)
        assert by_step[0] == pytest.approx(float(run), rel=1e-3)
    assert float(found["departure"].isel(check=0).max()) == 0.0
    assert float(found["error"].sel(structure="intact").max()) == 0.0


def test_the_report_tells_both_losses_and_the_errors(wave: Wave) -> None:
    facts = {fact["key"]: fact for fact in json.loads((wave.page / "facts.json").read_text())}
    loss = wave.built.response["loss_samples"].isel(case=0).sel(structure="cloaked")
    assert facts["loss_sum_cloaked"]["value"] == pytest.approx(np.sqrt(60) * float(loss))
    run = wave.verification["error"].isel(check=0).sel(structure="cloaked")
    assert facts["error_cloaked"]["value"] == pytest.approx(float(run), rel=1e-2)
    assert facts["edge_contacts_intact"]["value"] == 2
    for name in ("index.html", "fig7.png", "waves.csv", "steps.csv"):
        assert (wave.page / name).stat().st_size > 0
