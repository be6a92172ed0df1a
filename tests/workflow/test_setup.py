"""An environment from a folder of packages, without a network."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from pipeline.runtime import ROOT

WHEEL = "nothing-1.0-py3-none-any.whl"
FILES = {
    "nothing.py": "value = 1\n",
    "nothing-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: nothing\nVersion: 1.0\n",
    "nothing-1.0.dist-info/WHEEL": (
        "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    ),
    "nothing-1.0.dist-info/RECORD": "",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the Makefile, a package in wheels/, and a lock that asks for it."""
    shutil.copy(ROOT / "Makefile", tmp_path)
    (tmp_path / "wheels").mkdir()
    with ZipFile(tmp_path / "wheels" / WHEEL, "w") as wheel:
        for name, text in FILES.items():
            wheel.writestr(name, text)
    found = hashlib.sha256((tmp_path / "wheels" / WHEEL).read_bytes()).hexdigest()
    (tmp_path / "requirements.lock").write_text(f"nothing==1.0 --hash=sha256:{found}\n")
    return tmp_path


def set_up(folder: Path) -> subprocess.CompletedProcess[str]:
    unwanted = {"MAKEFLAGS", "MAKELEVEL", "MFLAGS", "PIP_NO_INDEX", "PIP_FIND_LINKS"}
    return subprocess.run(
        ["make", "setup", "WHEELS=wheels", f"PYTHON={sys.executable}"],
        cwd=folder,
        env={name: value for name, value in os.environ.items() if name not in unwanted},
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_folder_of_packages_is_enough(folder: Path) -> None:
    ended = set_up(folder)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    python = folder / ".venv/bin/python"
    subprocess.run([str(python), "-c", "import nothing"], check=True)
    assert set_up(folder).stdout.strip().endswith("Nothing to be done for 'setup'.")
