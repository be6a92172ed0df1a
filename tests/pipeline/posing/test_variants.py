"""Faults of presets and designs are found before a run meets them, without solving."""

from pathlib import Path

import pytest

from pipeline.posing import variant_faults
from tests.pipeline import static

VARIANTS = """
designs: { void.disc.radius: [7 mm, 8 mm, 0 mm, 400 mm] }
presets:
  quick: { horizon: { steps: 2 } }
  typo: { horizon: { stepz: 2 } }
  empty:
  far: { drive: { amplitude: 900 mm } }
"""


@pytest.fixture
def source(tmp_path: Path) -> Path:
    folder = tmp_path / "mine"
    folder.mkdir()
    return static.write(folder, static.HOLE + VARIANTS, size=5, amplitude=3.0)


def test_variants_without_faults(source: Path) -> None:
    assert variant_faults(source, ["", "quick", "1", "2", "quick.1"]) == {}


def test_each_variant_tells_its_own_fault(source: Path, caplog: pytest.LogCaptureFixture) -> None:
    found = variant_faults(source, ["", "3", "4", "quick", "typo", "empty", "far"])
    assert {name: (fault.what.partition(":")[0], fault.key) for name, fault in found.items()} == {
        "3": ("mine@3", "void.disc.radius"),
        "4": ("mine@4", "void"),
        "typo": ("mine@typo", "presets.typo.horizon.stepz"),
        "empty": ("mine@empty", "presets.empty"),
        "far": ("mine@far", "drive.amplitude"),
    }
    assert all(fault.file == str(source) and fault.remedy for fault in found.values())
    assert caplog.records == []


def test_a_fault_of_several_is_told_once(source: Path) -> None:
    """That of the first variant as it is; others by the names of those that share it."""
    source.write_text(source.read_text().replace("law: angle", "law: anglle"))
    (found,) = variant_faults(source, ["", "quick", "1", "2"]).values()
    assert found.what == "not one of the choices"
    every = ["typo", "1", "2", "far", "quick", "quick.1", "quick.2"]
    _, found = variant_faults(source, every).values()
    assert found.what == "mine@1, mine@2, mine@far and 1 more: not one of the choices"
