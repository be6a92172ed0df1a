"""The full studies reach the losses that tests/data/studies.yaml expects of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

from pipeline.environment import ROOT
from tests.e2e.stages import build

EXPECTED = yaml.safe_load((ROOT / "tests/data/studies.yaml").read_text())


@dataclass(frozen=True)
class Expected:
    """Losses of a study: of the structure that is altered, and of the design shipped."""

    altered: float
    cloaked: float
    tolerance: float


@pytest.mark.parametrize("target", EXPECTED)
def test_a_study_reaches_its_loss(target: str, tmp_path: Path) -> None:
    expected = Expected(**EXPECTED[target])
    name, _, preset = target.partition("@")
    built = build(ROOT / f"experiments/{name}/problem.yaml", preset or None, tmp_path)
    losses = built.response["loss"].isel(case=0)
    assert float(losses.sel(structure="altered")) == pytest.approx(expected.altered, rel=1e-6)
    reached = float(losses.sel(structure="cloaked"))
    assert reached <= expected.cloaked * (1 + expected.tolerance)
    assert reached == pytest.approx(built.best_loss, rel=1e-6)
    assert float(built.design["constraint_margin"].min()) >= 0.0
    assert int(built.design["overlaps"]) == 0
    assert (built.response["stability"].sel(structure="cloaked") == 1).all()
