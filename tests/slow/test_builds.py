"""Builds that take minutes: twice, ended at any moment, from a crate, and without a network."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.runtime import ROOT
from pipeline.workflow.reproduce import differences
from tests.e2e.checkout import Checkout
from tests.e2e.test_resume import ENDS, check_ends

TARGET = "fig2@quick"


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A checkout in which everything was compiled and built from nothing."""
    made = Checkout.made(tmp_path_factory.mktemp("first") / "checkout")
    return build(replace(made, own_caches=True))


def build(checkout: Checkout) -> Checkout:
    ended = checkout.make(TARGET)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


def test_builds_anywhere_have_the_same_bytes(first: Checkout, tmp_path: Path) -> None:
    second = build(first.copied(tmp_path / "a deeper folder/größer"))
    assert second.built(TARGET) == first.built(TARGET)
    second = first.copied(tmp_path / "checkout")
    assert build(second).built(TARGET) == first.built(TARGET)


def test_no_end_at_any_moment_changes_the_results(undisturbed: Checkout, fresh: Checkout) -> None:
    check_ends(ENDS, undisturbed, fresh)


NOWHERE = {"http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}


def run(folder: Path, *words: str, **more: str) -> None:
    unwanted = {"MAKEFLAGS", "MAKELEVEL", "MFLAGS"}
    environment = {name: value for name, value in os.environ.items() if name not in unwanted}
    subprocess.run(words, cwd=folder, env=environment | more, check=True)


def make(folder: Path, *words: str, **more: str) -> None:
    run(folder, "make", *words, f"PYTHON={sys.executable}", **more)


@pytest.fixture(scope="module")
def crate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = Checkout.made(tmp_path_factory.mktemp("published") / "checkout")
    assert made.make(TARGET).returncode == 0
    words = [sys.executable, "-m", "pipeline", "publish", TARGET]
    subprocess.run(words, cwd=made.root, check=True)
    return made.root / f"results/{TARGET}_crate"


def test_a_published_study_builds_itself_again(crate: Path, tmp_path: Path) -> None:
    packages = f"WHEELS={tmp_path / 'packages'}"
    make(crate, "wheels", packages)
    make(crate, "setup", packages, **NOWHERE)
    make(crate, TARGET, **NOWHERE)
    count, apart = differences(crate / "published" / TARGET, crate / "results" / TARGET)
    assert count > 20
    assert apart == []


def test_an_installation_without_a_network(tmp_path: Path) -> None:
    """From a folder of packages, as docs/install.md tells it."""
    script = "pipeline/workflow/install_lock.py"
    (tmp_path / script).parent.mkdir(parents=True)
    locks = (path.name for path in ROOT.glob("requirements*.lock"))
    for name in ("Makefile", *locks, script):
        shutil.copy(ROOT / name, tmp_path / name)
    make(tmp_path, "wheels", "WHEELS=packages")
    make(tmp_path, "dev", "WHEELS=packages", **NOWHERE)
    python = str(tmp_path / ".venv/bin/python")
    run(ROOT, python, "-m", "pytest", "tests/workflow/test_imports.py")
