"""The name of the compiled loops' cache follows what the loops are made of."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pipeline.runtime import ROOT
from pipeline.runtime.source_closure import kernels_hash, loop_files


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for room in ("sim", "pipeline"):
        kept = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / room, tmp_path / room, ignore=kept)
    return tmp_path


def test_the_hash_of_loops_is_of_what_the_files_say(checkout: Path) -> None:
    assert kernels_hash(checkout) == kernels_hash()


@pytest.mark.parametrize("file", [path.relative_to(ROOT) for path in loop_files()], ids=str)
def test_a_byte_in_a_loop_or_in_what_it_imports_compiles_again(checkout: Path, file: Path) -> None:
    before = kernels_hash(checkout)
    (checkout / file).write_bytes((checkout / file).read_bytes() + b"\n")
    kernels_hash.cache_clear()
    loop_files.cache_clear()
    assert kernels_hash(checkout) != before


def test_every_file_that_compiles_is_among_them() -> None:
    compiling = {
        path
        for room in ("sim", "pipeline")
        for path in (ROOT / room).rglob("*.py")
        if any(line.startswith(("@compiled", "@inlined")) for line in path.read_text().splitlines())
    }
    assert compiling
    assert compiling <= set(loop_files())


@pytest.mark.parametrize("file", ["sim/scene/plan.py", "pipeline/tracking/motion/tracker.py"])
def test_an_edit_elsewhere_keeps_the_compiled_loops(checkout: Path, file: str) -> None:
    before = kernels_hash(checkout)
    (checkout / file).write_text((checkout / file).read_text() + "# more\n")
    kernels_hash.cache_clear()
    loop_files.cache_clear()
    assert kernels_hash(checkout) == before
