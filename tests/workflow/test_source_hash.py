"""The closure of a module over import statements, and the hash of what it holds."""

import os
import shutil
from pathlib import Path

import pytest

from pipeline.runtime import source_closure
from pipeline.runtime.locations import ROOT
from pipeline.runtime.source_closure import source_files, source_hash
from tests.tables import cases, tables

FILES: dict[str, str] = tables("workflow")["sources"]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def closure(module: str, root: Path) -> set[str]:
    return {path.relative_to(root).as_posix() for path in source_files(module, root)}


@cases("workflow", "module, files")
def test_a_closure_holds_imports_and_resources(tree: Path, module: str, files: list[str]) -> None:
    assert closure(module, tree) == set(files)


def test_unknown_module_is_refused(tree: Path) -> None:
    with pytest.raises(ModuleNotFoundError, match=r"pipeline\.missing"):
        source_files("pipeline.missing", tree)


@pytest.mark.parametrize(
    ("edited", "changes"),
    [("sim/inner/deep.py", True), ("sim/unused.py", False), ("reports/build.py", False)],
)
def test_hash_follows_the_content_of_the_closure(tree: Path, edited: str, changes: bool) -> None:
    before = source_hash("pipeline.stage", tree)
    (tree / edited).write_text("value = 2\n")
    forget()
    assert (source_hash("pipeline.stage", tree) != before) is changes


def forget() -> None:
    """As a process that begins."""
    for known in (source_hash, source_files, source_closure._tree_hash):
        known.cache_clear()


def test_hashes_of_an_installed_package_are_among_the_users_caches(
    tree: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    forget()
    monkeypatch.setattr(source_closure, "ROOT", tree)
    monkeypatch.setattr(source_closure, "CACHE", tmp_path / "user/metacloak")
    assert source_hash("pipeline.stage", tree)
    assert (tmp_path / "user/metacloak/source_hashes.json").is_file()
    assert not (tree / ".cache").exists()


def test_imports_are_followed_once_for_a_tree(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, store = source_hash("pipeline.stage", tree), tree / ".cache/source_hashes.json"
    forget()
    with monkeypatch.context() as patch:
        patch.setattr(source_closure, "source_files", None)
        assert source_hash("pipeline.stage", tree) == before
    for damaged in ("", "[]", '{"tree": 1}'):
        store.write_text(damaged)
        forget()
        assert source_hash("pipeline.stage", tree) == before


def test_hash_ignores_date_and_place(tree: Path, tmp_path: Path) -> None:
    before, elsewhere = source_hash("pipeline.stage", tree), tmp_path.with_name("elsewhere")
    tree.rename(elsewhere)
    shutil.rmtree(elsewhere / ".cache")
    for name in FILES:
        os.utime(elsewhere / name, (1, 1))
    forget()
    assert source_hash("pipeline.stage", elsewhere) == before


def test_closure_of_the_problem_reader_is_what_python_imports() -> None:
    found = closure("pipeline.problem.reading.loading", ROOT)
    assert "pipeline/problem/model.py" in found
    assert "pipeline/runtime/locations.py" in found
    assert not any(name.startswith("reports/") for name in found)
