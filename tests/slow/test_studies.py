"""The full studies reach the losses and designs that tests/data/studies.yaml expects of them."""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml

from pipeline.posing import UNSTABLE, design_hash
from pipeline.runtime import ROOT
from sim.core.instruction_set import can_pin
from tests.e2e import stages
from tests.e2e.stages import Built, build, build_verification

EXPECTED = yaml.safe_load((ROOT / "tests/data/studies.yaml").read_text())
TOLERANCE = 0.1
"""Part by which a loss may exceed that expected."""


@dataclass(frozen=True)
class Expected:
    """Losses of a study: of the structure that is altered, and of the design shipped.

    `shorter` is that of the design shipped with a quarter of the time step, of a motion in time;
    `design` is its hash at the pinned level of instructions. On its path it snaps at most
    `snaps` times, and no more than `overlaps` pairs of units overlap, null if any may.
    """

    altered: float
    cloaked: float
    design: str | None = None
    shorter: float | None = None
    snaps: int = 0
    overlaps: int | None = 0

    def check(self, built: Built, most: float) -> None:
        """The design reaches a loss, can be made, and is followed through stable states."""
        losses = built.response["loss"].mean("case")
        reached = float(losses.sel(structure="cloaked"))
        assert reached <= most * (1 + TOLERANCE)
        # a motion's steps are as short as each structure needs them: a design's, and then its own
        in_time = bool(np.abs(built.response["velocity"]).max() > 0.0)
        assert reached == pytest.approx(built.best_loss, rel=1e-4 if in_time else 1e-6)
        assert float(built.design["constraint_margin"].min()) >= 0.0
        assert int(built.design["overlaps"]) == 0
        path = built.response.sel(structure="cloaked")
        assert (path["stability"] != UNSTABLE).all()
        assert int(np.isfinite(path["snap"]).sum()) <= self.snaps
        assert self.overlaps is None or int(path["overlaps"].max()) <= self.overlaps


@pytest.fixture(autouse=True)
def apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs stages as processes of their own: NumPy was imported here before it could be pinned."""

    def run(stage: str, words: list[str]) -> int:
        command = [sys.executable, "-m", "pipeline", stage, *words]
        return subprocess.run(command, cwd=ROOT, check=False).returncode

    monkeypatch.setattr(stages, "run_stage", run)


@pytest.mark.parametrize("target", EXPECTED)
def test_a_study_reaches_its_losses(target: str, tmp_path: Path) -> None:
    expected = Expected(**EXPECTED[target])
    name, _, preset = target.partition("@")
    study = ROOT / f"experiments/{name}/problem.yaml", preset or None, tmp_path
    built = build(*study)
    altered = float(built.response["loss"].mean("case").sel(structure="altered"))
    assert altered == pytest.approx(expected.altered, rel=1e-6)
    expected.check(built, expected.cloaked)
    if expected.shorter is not None:
        by_step = build_verification(*study)["loss"].sel(structure="cloaked")
        assert float(by_step.isel(check=2)) == pytest.approx(float(by_step.isel(check=0)), rel=1e-3)
        assert float(by_step.isel(check=2)) <= expected.shorter * (1 + TOLERANCE)
    if expected.design is not None and can_pin():
        assert design_hash(built.design) == expected.design
