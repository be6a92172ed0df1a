"""A published study is built again from itself, with a folder of packages and no network."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.workflow.reproduce import differences
from tests.e2e.checkout import Checkout

TARGET = "fig2@quick"
UNWANTED = {"MAKEFLAGS", "MAKELEVEL", "MFLAGS"}
NOWHERE = {"http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}


def make(folder: Path, *words: str, **more: str) -> None:
    environment = {name: value for name, value in os.environ.items() if name not in UNWANTED}
    told = ["make", *words, f"PYTHON={sys.executable}"]
    subprocess.run(told, cwd=folder, env=environment | more, check=True)


@pytest.fixture(scope="module")
def crate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = Checkout.made(tmp_path_factory.mktemp("published") / "checkout")
    assert made.make(TARGET).returncode == 0
    words = [sys.executable, "-m", "pipeline", "publish", TARGET]
    subprocess.run(words, cwd=made.root, check=True)
    return made.root / f"results/{TARGET}_crate"


def test_it_builds_the_same_bytes(crate: Path, tmp_path: Path) -> None:
    packages = f"WHEELS={tmp_path / 'packages'}"
    make(crate, "wheels", packages)
    make(crate, "setup", packages, **NOWHERE)
    make(crate, TARGET, **NOWHERE)
    count, apart = differences(crate / "published", crate / "results" / TARGET)
    assert count > 20
    assert apart == []
