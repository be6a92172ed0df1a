from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.stages import certify, front
from reports.__main__ import main
from sim.core import SimulationError
from sim.load_family import LoadLosses
from tests.pipeline import unchanged
from tests.pipeline.conftest import Failing
from tests.pipeline.stages.test_certify import write
from tests.pipeline.static import designed

PRESETS = {
    "share": {"designs": {"objective.loads.nominal": [1, 0]}},
    "symmetry": {"designs": {"optimiser.symmetry": ["C4"]}},
}


def named(path: Path, *names: str) -> list[str]:
    files = {name: path.with_name(f"{name}.nc") for name in names}
    for name, file in files.items():
        designed(path, "--preset", name).rename(file)
    return [f"{name}={file}" for name, file in files.items()]


@pytest.mark.slow
def test_several_designs_under_own_and_worst_loads(
    fig2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(front, "SPREAD", 4)
    monkeypatch.setattr(front, "SEARCHES", 1)
    path, out = write(fig2, tmp_path, presets=PRESETS), tmp_path / "front.nc"
    words = ["--problem", str(path), "--quiet"]
    made = named(path, "share.1", "share.2", "symmetry.1")
    run = [*words, "--designs", *made, "--out", str(out)]
    assert run_stage("front", run) == 0
    data = datasets.read(out, "front")
    assert data["design"].to_numpy().tolist() == ["share.1", "share.2", "symmetry.1"]
    assert data["setting"].to_numpy().tolist() == ["1", "0", "C4"]
    assert (data["worst_loss"] > data["nominal_loss"]).all()
    assert (data["altered_loss"] > 0.0).all()
    assert (data["worst_frequency"] <= 8.0).all()
    before = out.read_bytes()
    monkeypatch.setattr(LoadLosses, "value", None)  # the journal has them all
    assert run_stage("front", run) == 0
    assert out.read_bytes() == before


@pytest.mark.slow
def test_the_page_shows_the_certificates_of_the_ends(
    fig2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module, counts in ((front, ("SPREAD", "SEARCHES")), (certify, ("LOADS", "SEARCHES"))):
        for name in counts:
            monkeypatch.setattr(module, name, 2)
    path, out = write(fig2, tmp_path, presets=PRESETS), tmp_path / "front.nc"
    words, made = ["--problem", str(path), "--quiet"], named(path, "share.2", "symmetry.1")
    assert run_stage("front", [*words, "--designs", *made, "--out", str(out)]) == 0
    certificate = tmp_path / "mine@share.2/certificate.nc"
    certificate.parent.mkdir()
    of_end = ["--preset", "share.2", "--design", made[0].partition("=")[2]]
    assert run_stage("certify", [*words, *of_end, "--out", str(certificate)]) == 0
    shown = ["--front", str(out), "--certificates", str(certificate), "--out-dir", str(tmp_path)]
    assert main(["front", *words, *shown]) == 0
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    worst = float(datasets.read(certificate, "certificate")["loss"].max())
    assert f"<td>{worst:.4g}</td>" in text
    assert "Over the optimiser.symmetry" in text
    table = pd.read_csv(tmp_path / "front.csv")
    assert table["design"].tolist() == ["share.2", "symmetry.1"]


def test_loads_that_all_fail_leave_gaps(
    fig2: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsolvable(*_: object) -> None:
        raise SimulationError("no equilibrium")

    monkeypatch.setattr(front, "SPREAD", 2)
    monkeypatch.setattr(front, "SEARCHES", 1)
    energy = {"kind": "strain_energy", "target": "rest"}
    path, out = write(fig2, tmp_path, presets=PRESETS, objective=energy), tmp_path / "front.nc"
    file = unchanged.write(path, "share.1")
    for name in ("value", "__call__"):
        monkeypatch.setattr(LoadLosses, name, unsolvable)
    words = ["--problem", str(path), "--quiet", "--out", str(out)]
    assert run_stage("front", [*words, "--designs", f"share.1={file}"]) == 0
    data = datasets.read(out, "front")
    for name in ("nominal_loss", "worst_loss", "altered_loss"):
        assert np.isnan(data[name]).all()
        assert data[name].attrs["units"] == "N mm"
    assert main(["front", *words[:3], "--front", str(out), "--out-dir", str(tmp_path)]) == 0


def test_designs_are_those_of_presets_that_ask_for_several(
    fig2: Path, tmp_path: Path, failing: Failing
) -> None:
    words = ["--problem", str(write(fig2, tmp_path, presets=PRESETS))]
    words += ["--out", str(tmp_path / "front.nc")]
    assert "unbiased_share" in failing("front", [*words, "--designs"])
    design = tmp_path / "design.nc"
    design.touch()
    assert "one of several designs" in failing("front", [*words, "--designs", f"share={design}"])
