from pathlib import Path

import pytest

from pipeline.posing import PosedStructure, StoppedError, Times
from pipeline.stages import simulate
from sim.core import SimulationError
from tests.pipeline.conftest import Failing
from tests.pipeline.static import HOLE, designed, write

FAR = 20_000  # a step of the solver's own, of which there are more than output times


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    """A small lattice shaken along its left edge, with the design of one that is compressed."""
    path = write(tmp_path, HOLE, size=5, amplitude=3.0)
    designed(path)
    text = path.read_text(encoding="utf-8")
    for old, new in (
        ("kind: linear_ramp", "kind: ramp_harmonic\n  frequency: 20 Hz\n  rise_time: 50 ms"),
        ("  duration: 1 s\n", ""),
        ("duration: 1 s, steps: 4", "periods: 2, samples: 12"),
        ("samples: 9", "cycles: 2, samples: 13"),
        ("supports:\n  - units: left\n", ""),
        (", geometric: { evaluations: 3 }", ""),
    ):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_motion_that_cannot_be_followed_ends_in_one_error(
    wave: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: Failing
) -> None:
    def measured(structures: dict[str, PosedStructure], times: Times, _: int) -> None:
        error = SimulationError("the explicit run is unstable", step=FAR)
        raise StoppedError(error, structures["cloaked"].scene, "cloaked", times.asked)

    monkeypatch.setattr(simulate, "measured_cases", measured)
    words = ["--problem", str(wave), "--quiet", "--out", str(tmp_path / "r.nc")]
    told = failing("simulate", [*words, "--design", str(wave.with_name("design.nc"))])
    assert "the cloaked structure cannot be simulated: the explicit run is unstable" in told
