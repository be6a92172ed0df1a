"""The package that is installed: one name, the workflow in it, and studies in any folder."""

import os
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from pipeline.runtime import ROOT

SAME = """
import pickle, sys
import metacloak
assert "jax" not in sys.modules
import metacloak.sim.structure as installed
from metacloak.sim.structure import Lattice
assert installed.Lattice is Lattice
assert pickle.loads(pickle.dumps(Lattice)) is Lattice
assert installed is metacloak.sim.structure
assert installed.__spec__.name == installed.__name__
"""
IN_A_CHECKOUT = (
    SAME
    + """
import sim.structure
assert sim.structure is installed and metacloak.sim is sys.modules["sim"]
"""
)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, unpacked."""
    folder = tmp_path_factory.mktemp("wheel")
    words = ("wheel", str(ROOT), "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder))
    subprocess.run([sys.executable, "-m", "pip", *words], check=True, capture_output=True)
    with ZipFile(next(folder.glob("metacloak-*.whl"))) as packed:
        packed.extractall(folder / "site")
    return folder / "site"


def ran(code: Path, folder: Path, *words: str) -> str:
    """Runs a command of the package, without checkout or caches; returns what it prints."""
    hidden = ("PYTHONPATH", "JAX_COMPILATION_CACHE_DIR", "MPLCONFIGDIR")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    environment |= {"PYTHONPATH": str(code), "XDG_CACHE_HOME": str(folder / "caches")}
    ended = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout + ended.stderr


def test_there_is_one_name_with_all_that_the_workflow_needs(wheel: Path) -> None:
    names = {path.name for path in wheel.iterdir() if path.suffix != ".dist-info"}
    assert names == {"metacloak"}
    for name in (
        *("Snakefile", "CITATION.cff", "py.typed", "profiles/default/config.yaml"),
        *("sim/core/__init__.pyi", "pipeline/rules/design.smk", "reports/__init__.py"),
        *("pipeline/workflow/templates/static.yaml", "pipeline/__main__.py"),
    ):
        assert (wheel / "metacloak" / name).is_file(), name
    files = [path for path in ROOT.glob("reports/**/*") if path.is_file()]
    kinds = {path.suffix for path in files if "__pycache__" not in path.parts}
    assert kinds <= {path.suffix for path in wheel.glob("metacloak/reports/**/*")}


def test_modules_have_one_identity(wheel: Path, tmp_path: Path) -> None:
    ran(wheel, tmp_path, "-c", SAME)
    ran(ROOT, tmp_path, "-c", IN_A_CHECKOUT)


@pytest.mark.slow
def test_a_study_is_made_and_planned_in_an_empty_folder(wheel: Path, tmp_path: Path) -> None:
    command = ("-m", "metacloak")
    assert "usage: metacloak STAGE" in ran(wheel, tmp_path, *command, "--help")
    assert "metacloak run mine@quick" in ran(wheel, tmp_path, *command, "new", "mine")
    planned = ran(wheel, tmp_path, *command, "run", "mine@quick", "--dry-run", "--printshellcmds")
    assert "python -m metacloak.pipeline design --problem experiments/mine/" in planned
    assert {path.name for path in tmp_path.iterdir()} <= {"experiments", ".snakemake", "caches"}
