"""Directions of responses: as drives give them, or those of a motion that was measured."""

from pathlib import Path

import numpy as np
import pytest

from pipeline import datasets
from pipeline.__main__ import run_stage
from pipeline.posing import case_directions, main_direction
from pipeline.problem import load
from tests.pipeline import static, unchanged

SHAKEN = (
    "drive: { kind: time_series, units: right, file: shaker.csv }\nhorizon: { duration: 0.02 s }"
)
SHAKER = "time (s),ux (mm),uy (mm),theta (rad)\n0,0,0,0\n0.01,0.1,-1,0\n0.02,0.1,-2,0\n"


@pytest.fixture
def shaken(tmp_path: Path) -> Path:
    """Writes a problem whose right side a shaker moves."""
    path = static.write(tmp_path, static.HOLE, size=5)
    text = path.read_text(encoding="utf-8")
    start, end = text.index("drive:"), text.index("constraints:")
    path.write_text(f"{text[:start]}{SHAKEN}\n{text[end:]}", encoding="utf-8")
    (tmp_path / "shaker.csv").write_text(SHAKER, encoding="utf-8")
    return path


def test_a_measured_motion_has_the_direction_of_its_largest_displacement(shaken: Path) -> None:
    """Forces of a shaker along -y are told along -y."""
    design, out = unchanged.write(shaken), shaken.with_name("response.nc")
    words = ["--problem", str(shaken), "--design", str(design), "--out", str(out), "--quiet"]
    assert run_stage("simulate", words) == 0
    wanted = np.rad2deg(np.arctan2(-2.0, 0.1))
    assert datasets.read(out, "response")["direction"].values == pytest.approx([wanted])


def test_a_motion_that_only_turns_has_none(shaken: Path) -> None:
    assert main_direction(np.zeros((3, 2))) is None
    assert case_directions(load(shaken), np.zeros((1, 3, 2))) == [0.0]


def test_given_directions_stay(tmp_path: Path) -> None:
    asked = load(static.write(tmp_path, static.HOLE, size=5))
    assert case_directions(asked, np.ones((1, 3, 2))) == case_directions(asked) == [np.pi]
