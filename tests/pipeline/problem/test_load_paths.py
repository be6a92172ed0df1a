"""Tests what a load path of equilibria is refused, or asked to say once."""

from pathlib import Path

import pytest

from pipeline.problem.reading import load
from tests.pipeline import static
from tests.tables import refused

DRIVE = (
    "drive:\n  kind: linear_ramp\n  units: right\n  amplitude: 3.0 mm\n"
    "  directions: [180 deg]\n  duration: 1 s\n"
)
OTHER = "kind: tanh_ramp, units: right, amplitude: 3 mm, direction: 270 deg, duration: 2 s"


def written(folder: Path, old: str, new: str) -> Path:
    """Writes a small static problem after replacing `old` by `new` in its text."""
    path = static.write(folder, static.HOLE, size=5, amplitude=3.0)
    text = path.read_text(encoding="utf-8").replace(", steps: 4", "")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("horizon: { duration: 1 s", "horizon: { duration: 2 s", "drive.duration"),
        ("  duration: 1 s", "  duration: 0.4 s", "drive.duration"),
        (DRIVE, f"drives:\n  - {{ {OTHER} }}\n", "drives[0].duration"),
        (
            "intact",
            f"intact, loads: {{ setups: [{{ drive: {{ {OTHER} }} }}] }}",
            "objective.loads.setups[0].drive.duration",
        ),
    ],
)
def test_a_ramp_lasts_as_long_as_its_path(old: str, new: str, key: str, tmp_path: Path) -> None:
    with refused("the ramp lasts", key, "change `amplitude`"):
        load(written(tmp_path, old, new))
