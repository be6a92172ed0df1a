"""Compares a specimen that two plates squeeze: what its drive does is what the first plate does."""

from pathlib import Path

import numpy as np

from pipeline import datasets
from pipeline.__main__ import run_stage
from tests.pipeline import static, unchanged
from tests.pipeline.comparison.recorded import SIGMA, track, written

PLATES = """drives:
  - { kind: linear_ramp, units: right, amplitude: 2 mm, direction: 180 deg, duration: 1 s }
  - { kind: linear_ramp, units: left, amplitude: 2 mm, direction: 0 deg, duration: 1 s }
"""


def test_a_squeeze_from_both_sides_is_compared(tmp_path: Path) -> None:
    path = static.write(tmp_path, static.HOLE, size=5)
    text = path.read_text(encoding="utf-8").replace("supports:\n  - units: left\n", "", 1)
    start, end = text.index("drive:"), text.index("horizon:")
    path.write_text(f"{text[:start]}{PLATES}{text[end:]}", encoding="utf-8")
    design, moved = unchanged.write(path), tmp_path / "response.nc"
    given = ["--problem", str(path), "--design", str(design), "--quiet"]
    assert run_stage("simulate", [*given, "--out", str(moved)]) == 0
    response = datasets.read(moved, "response")
    np.testing.assert_allclose(response["drive_displacement"][0, -1], [-2.0, 0.0], atol=1e-12)
    time = np.arange(20) / 30
    film = track(datasets.read(design, "design"), response, "altered", time, np.linspace(0, 1, 20))
    options = written(film, tmp_path, "structure: altered\n")
    out = tmp_path / "comparison.nc"
    words = [*given, "--response", str(moved), *options, "--out", str(out)]
    assert run_stage("compare", words) == 0
    found = datasets.read(out, "comparison")
    assert found.attrs["axis"] == "load"
    np.testing.assert_allclose(found["drive_displacement"][-1], [-2.0, 0.0], atol=0.02)
    apart = found["rmse"].sel(side="simulated", estimate="value")
    np.testing.assert_allclose(apart, SIGMA, rtol=0.4)
