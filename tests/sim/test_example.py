"""The example in docs/ runs as it is printed there."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

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
    # the plan above names an allowed loss error, too
    before, after = map(float, re.findall(r"loss (\d\.\d+)", run.stdout.splitlines()[-1]))
    assert before == pytest.approx(0.0467, abs=1e-4)
    assert after == pytest.approx(0.0023, abs=2e-4)
    force = float(re.findall(r"drive (\d\.\d+) N", run.stdout)[0])
    assert force == pytest.approx(3.759, abs=2e-3)


def test_the_example_is_short_and_needs_sim_alone() -> None:
    text = EXAMPLE.read_text()
    code = [line for line in text.splitlines() if line.strip()]
    assert len(code) <= 40
    assert "sim.simulate(" in "".join(code[:20])
    imported = set(re.findall(r"^(?:from|import) (\w+)", text, re.MULTILINE))
    assert imported == {"numpy", "sim"}
