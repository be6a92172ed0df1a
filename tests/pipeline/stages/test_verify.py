"""A check that cannot be simulated keeps its reason, and the others their numbers."""

from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets, problem
from pipeline.__main__ import run_stage
from pipeline.posing import PosedStructure, StoppedError, Times
from pipeline.stages import simulate, verify
from sim.core import SimulationError
from sim.scene import Response
from tests.pipeline import static, unchanged
from tests.pipeline.conftest import Failing

STUCK = SimulationError("no equilibrium found beyond load 3 of 8", step=3)
WAVE = """drive:
  kind: harmonic
  units: left
  amplitude: 1.0 mm
  directions: [0 deg]
  frequency: 20 Hz
horizon: { periods: 1, samples: 8 }
"""


def words(path: Path) -> list[str]:
    design = path.with_name("design.nc")
    out = path.with_name("verification.nc")
    return ["--problem", str(path), "--design", str(design), "--quiet", "--out", str(out)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = static.write(tmp_path, static.HOLE, size=5, amplitude=1.0)
    unchanged.write(made)
    return made


@pytest.fixture
def wave(path: Path) -> Path:
    text = path.read_text(encoding="utf-8").replace("supports:\n  - units: left\n", "")
    start, end = text.index("drive:"), text.index("constraints:")
    shown = text[end:].replace("{ samples: 9 }", "{ cycles: 1, samples: 9 }")
    path.write_text(text[:start] + WAVE + shown, encoding="utf-8")
    return path


def fail_after(monkeypatch: pytest.MonkeyPatch, runs: int) -> None:
    """Lets so many variants be simulated, and no more."""
    done: list[Times] = []

    def measured(structures: dict[str, PosedStructure], times: Times, threads: int) -> object:
        if len(done) >= runs:
            raise StoppedError(STUCK, structures["cloaked"].scene, "cloaked", times.asked)
        done.append(times)
        return simulate.measured_cases(structures, times, threads)

    monkeypatch.setattr(verify, "measured_cases", measured)


def test_finer_loads_that_cannot_be_followed(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fail_after(monkeypatch, 1)
    assert run_stage("verify", words(path)) == 0
    made = datasets.read(path.with_name("verification.nc"), "verification")
    told = f"cloaked: {STUCK}"
    assert list(made["status"].values) == ["ok", told, told]
    assert np.isfinite(made["loss"].sel(check="as run")).all()
    assert np.isnan(made["loss"].isel(check=1)).all()


def test_loads_of_the_run_that_cannot_be_followed(
    path: Path, monkeypatch: pytest.MonkeyPatch, failing: Failing
) -> None:
    fail_after(monkeypatch, 0)
    assert "the cloaked structure cannot be simulated beyond" in failing("verify", words(path))
    assert not path.with_name("verification.nc").exists()


def test_shorter_steps_that_cannot_be_followed(wave: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refined(_: Response) -> None:
        raise STUCK

    monkeypatch.setattr(Response, "refined", refined)
    asked = problem.load(wave)
    made = verify.checks(asked, wave.parent, datasets.read(wave.with_name("design.nc"), "design"))
    assert list(made["status"].values) == ["ok", str(STUCK), str(STUCK), "ok"]
    assert np.isfinite(made["loss"].isel(check=3)).all()
