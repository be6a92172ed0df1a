"""The documentation renders, links to nothing that is not there, and needs no network."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.runtime import ROOT
from tests.docs.pages import PAGES

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
