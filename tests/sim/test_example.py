"""The example in docs/ runs as it is printed there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs/example_sim.py"


def test_the_example_lowers_its_loss() -> None:
    run = subprocess.run(
        [sys.executable, str(EXAMPLE)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    before, after = map(float, re.findall(r"loss (\d\.\d+)", run.stdout))
    assert 0 < after < 0.5 * before


def test_the_example_is_short_and_needs_sim_alone() -> None:
    text = EXAMPLE.read_text()
    code = [line for line in text.splitlines() if line.strip()]
    assert len(code) <= 40
    imported = set(re.findall(r"^(?:from|import) (\w+)", text, re.MULTILINE))
    assert imported == {"numpy", "sim"}
