from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pipeline.environment import ROOT, kernels_hash


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for room in ("sim", "pipeline/tracking"):
        kept = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / room, tmp_path / room, ignore=kept)
    return tmp_path


def test_the_hash_of_loops_is_of_what_the_files_say(checkout: Path) -> None:
    assert kernels_hash(checkout) == kernels_hash()


@pytest.mark.parametrize("file", ["sim/newton.py", "sim/geometry.py", "pipeline/tracking/patch.py"])
def test_an_edit_of_a_loop_or_of_what_it_imports_compiles_again(checkout: Path, file: str) -> None:
    before = kernels_hash(checkout)
    (checkout / file).write_text((checkout / file).read_text() + "# more\n")
    assert kernels_hash(checkout) != before


@pytest.mark.parametrize("file", ["sim/plan.py", "pipeline/tracking/tracker.py"])
def test_an_edit_elsewhere_keeps_the_compiled_loops(checkout: Path, file: str) -> None:
    before = kernels_hash(checkout)
    (checkout / file).write_text((checkout / file).read_text() + "# more\n")
    assert kernels_hash(checkout) == before
