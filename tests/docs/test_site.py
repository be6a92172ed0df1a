import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from pipeline.runtime import ROOT
from tests.docs.pages import PAGES
from tests.tables import tables

LOADED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*?\b(?:src|href)=\"?([^\"\s>]+)")


def test_the_site_is_whole_and_offline(tmp_path: Path) -> None:
    mkdocs = Path(sys.executable).with_name("mkdocs")
    words = [str(mkdocs), *["build", "--quiet", "--strict", "--site-dir"], str(tmp_path / "site")]
    subprocess.run(words, cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, check=True)
    for page in PAGES[1:]:
        html = (tmp_path / "site" / Path(page).name).with_suffix(".html")
        loaded = LOADED.findall(html.read_text(encoding="utf-8"))
        assert len(loaded) > 2
        assert not [name for name in loaded if "//" in name], page
    for style in (tmp_path / "site").rglob("*.css"):
        assert not re.search(r"@import|url\([\"']?http", style.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", PAGES)
def test_tests_that_pages_name_are_there(page: str) -> None:
    for file, name in re.findall(r"`(tests/\S+\.py)::(\w+)`", (ROOT / page).read_text()):
        assert f"def {name}(" in (ROOT / file).read_text(), f"{file}::{name}"


FOLDER = ROOT / "docs/examples"
PINNED: dict[str, dict[str, float]] = tables("docs")["examples"]
NAMES = sorted(p.stem for p in FOLDER.glob("*.py") if p.stem not in ("render", "specimen"))
SLOW = (
    "band_diagram",
    "error_estimate",
    "hidden_void",
    "resumed_run",
    "robust_design",
    "shielding_cloak",
    "static_cloak",
    "track_video",
)
"""The examples that take longest."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] if n in SLOW else []) for n in NAMES],
)
def test_an_example_gives_its_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(FOLDER), *sys.path])
    made = runpy.run_path(str(FOLDER / f"{name}.py"))
    found = {key: float(made[key]) for key in PINNED[name]}
    assert found == pytest.approx(PINNED[name], rel=1e-3, abs=1e-9)
    assert made["figure"].axes
    plt.close("all")


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short_and_shown(name: str) -> None:
    code = (FOLDER / f"{name}.py").read_text()
    assert len(code.splitlines()) <= 60
    assert (FOLDER / f"{name}.png").is_file()
    assert code.partition("\n")[2].lstrip() in (ROOT / "docs/examples.md").read_text()
