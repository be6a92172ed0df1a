"""Compiled loops are found by what they are made of: in any checkout, and in no edited one."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipeline.runtime import ROOT
from sim.core import TEMPORARY_NAME, import_closure
from sim.core.loop_cache import loop_hash

MARCH = "sim.quasistatics.equilibrium_path"
LOOPS = {
    "sim/loops.py": "from sim.core import compiled\nfrom sim.inner import inner\n\n"
    "@compiled\ndef outer(n):\n    return inner(n) + 1\n",
    "sim/inner.py": "from sim.core import compiled\n\n@compiled\ndef inner(n):\n    return 2 * n\n",
    "sim/other.py": "",
}
RUN = "from {} import outer as f; f(3); print(f(3), sum(f.stats.cache_misses.values()))"


def checkout(root: Path) -> Path:
    sources = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "sim/core", root / "sim/core", ignore=sources)
    for face in ("__init__.py", "__init__.pyi"):
        shutil.copy(ROOT / "sim" / face, root / "sim" / face)
    for name, text in LOOPS.items():
        (root / name).write_text(text)
    return root


def asked(
    root: Path, cache: Path, loops: str = "sim.loops", **places: str
) -> subprocess.CompletedProcess[str]:
    # byte code is current for Python where second and size agree: these edits come faster
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", RUN.format(loops)]
    how: dict[str, Any] = {"text": True, "capture_output": True}
    return subprocess.run(command, cwd=root, env=environment | places, check=False, **how)


def run(root: Path, cache: Path, loops: str = "sim.loops", **places: str) -> list[str]:
    told = asked(root, cache, loops, **places)
    assert told.returncode == 0, told.stderr
    return told.stdout.split()


def test_a_second_checkout_compiles_nothing_and_an_edited_one_does(tmp_path: Path) -> None:
    first, second = checkout(tmp_path / "first"), checkout(tmp_path / "second")
    cache = tmp_path / "cache"
    assert run(first, cache) == ["7", "1"]
    assert run(second, cache) == ["7", "0"]
    (second / "sim/other.py").write_text("unrelated = 1\n")
    assert run(second, cache) == ["7", "0"]
    (second / "sim/inner.py").write_text(LOOPS["sim/inner.py"].replace("2 * n", "5 * n"))
    assert run(second, cache) == ["16", "1"]


def test_a_folder_that_cannot_be_written_is_replaced_by_one_for_temporary_files(
    tmp_path: Path,
) -> None:
    root, spare = checkout(tmp_path / "checkout"), tmp_path / "spare"
    spare.mkdir()
    unwritable = root / "sim/inner.py" / "none"
    assert run(root, unwritable, TMPDIR=str(spare)) == ["7", "1"]
    assert run(root, unwritable, TMPDIR=str(spare)) == ["7", "0"]
    (root / "sim/inner.py").write_text(LOOPS["sim/inner.py"].replace("2 * n", "5 * n"))
    assert run(root, unwritable, TMPDIR=str(spare)) == ["16", "1"]
    assert not list(root.rglob("*.nbi"))


@pytest.mark.parametrize("way", ["others may write it", "link"])
def test_code_that_others_may_have_written_is_not_run(tmp_path: Path, way: str) -> None:
    root, spare = checkout(tmp_path / "checkout"), tmp_path / "spare"
    own = spare / TEMPORARY_NAME
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    spare.mkdir()
    if way == "link":
        own.symlink_to(tmp_path / "elsewhere")
    else:
        own.mkdir()
        own.chmod(0o777)
    told = asked(root, root / "sim/inner.py" / "none", TMPDIR=str(spare))
    assert told.returncode == 1
    assert "name another one by NUMBA_CACHE_DIR" in told.stderr
    assert not list(own.rglob("*.nb?"))


def test_a_script_of_the_checkout_is_compiled_anew_after_any_edit(tmp_path: Path) -> None:
    root, cache = checkout(tmp_path / "checkout"), tmp_path / "cache"
    texts = {
        "experiments/loops.py": "from sim.core import compiled\nfrom sim.inner import inner\n"
        "from experiments.step import STEP\n\n"
        "@compiled\ndef outer(n):\n    return inner(n) + STEP + 2 * n\n",
        "experiments/step.py": "STEP = 2 * 1\n",
    }
    (root / "experiments").mkdir()
    for name, text in texts.items():
        (root / name).write_text(text)
    assert run(root, cache, "experiments.loops") == ["14", "1"]
    assert run(root, cache, "experiments.loops") == ["14", "0"]
    values = {"experiments/loops.py": 17, "experiments/step.py": 18, "sim/inner.py": 21}
    for edited, value in values.items():
        path = root / edited
        path.write_text(path.read_text().replace("2 * ", "3 * "))
        assert run(root, cache, "experiments.loops") == [str(value), "1"]


def test_what_is_installed_within_the_checkout_keeps_the_places_of_numba(tmp_path: Path) -> None:
    root, cache = checkout(tmp_path / "checkout"), tmp_path / "cache"
    installed = root / ".venv/site-packages/other.py"
    installed.parent.mkdir(parents=True)
    installed.write_text(LOOPS["sim/inner.py"].replace("inner", "outer"))
    path = f"{root}{os.pathsep}{installed.parent}"
    assert run(root, cache, "other", PYTHONPATH=path) == ["6", "1"]
    installed.write_text(LOOPS["sim/inner.py"].replace("inner", "outer").replace("2 * n", "5 * n"))
    assert run(root, cache, "other", PYTHONPATH=path) == ["15", "1"]


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_damaged_file_is_compiled_again(tmp_path: Path, kind: str) -> None:
    root, cache = checkout(tmp_path / "checkout"), tmp_path / "cache"
    run(root, cache)
    for path in cache.rglob(f"*.{kind}"):
        path.write_bytes(b"" if kind == "nbi" else path.read_bytes()[:1000])
    told = asked(root, cache)
    assert told.stdout.split() == ["7", "1"]
    assert told.stderr.startswith(f"damaged files in {cache}")
    assert run(root, cache) == ["7", "0"]


FULL = """
import errno, os
from numba.core.caching import IndexDataCacheFile

def full(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

IndexDataCacheFile._save_data = full
"""


def test_a_full_disk_stops_no_run_and_is_told_once(tmp_path: Path) -> None:
    root, cache = checkout(tmp_path / "checkout"), tmp_path / "cache"
    (root / "full.py").write_text(FULL + "from sim.loops import outer\n")
    told = asked(root, cache, "full")
    assert told.stdout.split() == ["7", "1"], told.stderr
    (line,) = told.stderr.splitlines()
    assert f"kept in {cache}, each run compiles again: No space left" in line


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("copy")
    kept = shutil.ignore_patterns("__pycache__")
    for folder in ("sim", "pipeline"):
        shutil.copytree(ROOT / folder, root / folder, ignore=kept)
    return root


@pytest.mark.parametrize("module", sorted(import_closure([MARCH], ROOT, packages=False)))
def test_a_byte_in_any_file_that_a_loop_reaches_changes_its_hash(copy: Path, module: str) -> None:
    march = copy / f"{MARCH.replace('.', '/')}.py"
    before = loop_hash(march, copy)
    path = copy / f"{module.replace('.', '/')}.py"
    text = path.read_bytes()
    path.write_bytes(text + b"\n")
    loop_hash.cache_clear()
    try:
        assert loop_hash(march, copy) != before
    finally:
        path.write_bytes(text)
        loop_hash.cache_clear()


def test_the_path_of_equilibria_reaches_its_kernels_through_faces() -> None:
    reached = set(import_closure([MARCH], ROOT, packages=False))
    assert {"sim.energy.ligament_kernels", "sim.linalg.banded", "sim.core.compiling"} <= reached
    assert not {"sim.scene.plan", "sim.optimise.sqp", "sim.time_integration.explicit"} & reached
