"""The closure of a module over import statements, and the hash of what it holds."""

from pathlib import Path

import pytest

from pipeline.runtime import source_closure
from pipeline.runtime.locations import ROOT
from pipeline.runtime.source_closure import source_files, source_hash

FILES = {
    "sim/__init__.py": "",
    "sim/energy.py": "import numpy as np\n",
    "sim/inner/__init__.py": "from .deep import value\n",
    "sim/inner/deep.py": "value = 1\n",
    "sim/unused.py": "",
    "pipeline/__init__.py": "",
    "pipeline/cli.py": "from pipeline import errors\n",
    "pipeline/errors.py": "",
    "pipeline/rules/a.smk": "",
    "pipeline/late.py": "def f():\n    from sim import energy\n    import sim.inner\n",
    "pipeline/stage.py": "from . import late\nfrom .cli import main\nfrom sim.energy import law\n",
    "pipeline/loop_a.py": "import pipeline.loop_b\n",
    "pipeline/loop_b.py": "import pipeline.loop_a\n",
    "sim/lazy/__init__.py": "",
    "sim/lazy/__init__.pyi": "from .wanted import law as law\nfrom .other import less as less\n",
    "sim/lazy/wanted.py": "",
    "sim/lazy/other.py": "",
    "pipeline/through_a_face.py": "from sim.lazy import law\n",
    "reports/__init__.py": "",
    "reports/build.py": "import pipeline.errors\n",
    "reports/build.yaml": "prose of the module",
    "reports/unused.py": "",
    "reports/unused.yaml": "prose of another module",
    "reports/templates/page.html": "<html>",
    "reports/style.mplstyle": "",
    "reports/other/__init__.py": "",
    "reports/other/unused.css": "",
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def closure(module: str, root: Path) -> set[str]:
    return {path.relative_to(root).as_posix() for path in source_files(module, root)}


def test_closure_follows_every_form_of_import(tree: Path) -> None:
    assert closure("pipeline.stage", tree) == {
        "pipeline/__init__.py",
        "pipeline/cli.py",
        "pipeline/errors.py",
        "pipeline/late.py",
        "pipeline/stage.py",
        "sim/__init__.py",
        "sim/energy.py",
        "sim/inner/__init__.py",
        "sim/inner/deep.py",
    }


def test_closure_follows_one_name_through_a_lazy_package(tree: Path) -> None:
    assert closure("pipeline.through_a_face", tree) == {
        "pipeline/__init__.py",
        "pipeline/through_a_face.py",
        "sim/__init__.py",
        "sim/lazy/__init__.py",
        "sim/lazy/wanted.py",
    }


def test_closure_ends_in_circular_imports(tree: Path) -> None:
    assert closure("pipeline.loop_a", tree) == {
        "pipeline/__init__.py",
        "pipeline/loop_a.py",
        "pipeline/loop_b.py",
    }


def test_closure_holds_the_resources_of_its_packages_only(tree: Path) -> None:
    assert closure("reports.build", tree) == {
        "pipeline/__init__.py",
        "pipeline/errors.py",
        "reports/__init__.py",
        "reports/build.py",
        "reports/build.yaml",
        "reports/style.mplstyle",
        "reports/templates/page.html",
    }


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


def test_hash_ignores_dates_and_places(
    tree: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "copy"
    tree.rename(elsewhere)
    for name in FILES:
        (elsewhere / name).touch()
    moved = source_hash("pipeline.stage", elsewhere)
    elsewhere.rename(tree)
    assert source_hash("pipeline.stage", tree) == moved


def test_closure_of_the_problem_reader_is_what_python_imports() -> None:
    found = closure("pipeline.problem.reading.loading", ROOT)
    assert "pipeline/problem/model.py" in found
    assert "pipeline/runtime/locations.py" in found
    assert not any(name.startswith("reports/") for name in found)
