"""A track tells the ratios of stiffness, whatever stays with its units and however it is driven."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.runtime import ROOT
from tests.pipeline.calibration.specimens import TRUTH, described, written

SPECIMEN = ROOT / "experiments/calibration/specimens/squeezed.yaml"
TRACK = """
{ kind: track, name: motion, problem: squeezed.yaml, structure: altered, every: 2,
  virtual: { rate: 8 Hz, noise: { displacement: 0.002 mm, rotation: 0.01 deg },
             bias: { displacement: 0.05 mm, rotation: 0.2 deg } } }
"""


def test_ratios_of_stiffness_from_motion_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(SPECIMEN, tmp_path / "squeezed.yaml")
    track = yaml.safe_load(TRACK)
    start = TRUTH | {"bending_stiffness": "1.8 N mm/rad"}
    text = described([track], ["bending_stiffness", "damping_ratio"], material=start)
    path = written(tmp_path, text)
    folder, out = tmp_path / "data", tmp_path / "found.nc"
    words = ["synthesise", str(path), "--out-dir", str(folder), "--quiet"]
    assert run_stage("calibrate", words) == 0
    assert datasets.read(folder / "motion.nc", "track").attrs["synthetic"] == "yes"
    assert run_stage("calibrate", [str(folder / "calibration.yaml"), "--out", str(out)]) == 0
    found = datasets.read(out, "calibration")
    bending = found.isel(parameter=0)
    assert bending["lower"] < 1.5 < bending["upper"]
    assert bending["standard_error"] < 0.25
    assert found["newton_step"] < 0.05
    assert "ratio: 0.0186  # not determined" in (tmp_path / "found.yaml").read_text()
    assert "damping_ratio is not determined by these data" in capsys.readouterr().err
    assert np.unique(found["channel"]).tolist() == [
        3 * unit + dof for unit in (1, 2, 5, 6, 9, 10, 13, 14) for dof in range(3)
    ]
