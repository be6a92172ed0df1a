"""The tutorial does as it says, with a draft in the place of its study."""

from __future__ import annotations

import re
from pathlib import Path

from pipeline.problem.reading import load, preset_names
from tests.docs.pages import text
from tests.docs.walk import Reader


def test_the_tutorial(tmp_path: Path) -> None:
    root = tmp_path / "checkout"
    told = Reader.in_folder(root, draft=True).told("docs/tutorial.md")
    problem = root / "experiments/logo/problem.yaml"
    assert load(problem).title == "Logo"
    assert preset_names(problem) == ("quick",)
    assert (root / "results/logo@quick/report/index.html").stat().st_size > 100_000
    altered, cloaked = re.findall(r"error ([\d.]+) force", told)
    assert float(cloaked) < 0.8 * float(altered)
    size = sum(path.stat().st_size for path in (root / "results/logo@quick").rglob("*"))
    stated = re.search(r"^\| a draft .*\| (\d+) \|$", text("docs/install.md"), re.MULTILINE)
    assert stated is not None
    assert 0.2 < size / (int(stated[1]) * 1e6) < 1.0
