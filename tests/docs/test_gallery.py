"""Every example runs, is short, gives the numbers that are pinned here, and is on the page."""

import runpy
import sys

import pytest

from pipeline.runtime import ROOT
from tests.tables import tables

FOLDER = ROOT / "docs/examples"
PINNED: dict[str, dict[str, float]] = tables("docs")["examples"]
NAMES = sorted(p.stem for p in FOLDER.glob("*.py") if p.stem not in ("render", "specimen"))
OPTIMISING = ("hidden_void", "resumed_run", "robust_design", "shielding_cloak")
"""Examples that take eight seconds and more: tests/slow runs them."""


@pytest.mark.parametrize("name", [name for name in NAMES if name not in OPTIMISING])
def test_an_example_gives_its_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_numbers(name, monkeypatch)


def check_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs an example, and compares its numbers with those pinned."""
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    made = runpy.run_path(str(FOLDER / f"{name}.py"))
    found = {key: float(made[key]) for key in PINNED[name]}
    assert found == pytest.approx(PINNED[name], rel=1e-3, abs=1e-9)
    assert made["figure"].axes


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short_and_shown(name: str) -> None:
    code = (FOLDER / f"{name}.py").read_text()
    assert len(code.splitlines()) <= 60
    assert (FOLDER / f"{name}.png").is_file()
    assert code.partition("\n")[2].lstrip() in (ROOT / "docs/examples.md").read_text()
