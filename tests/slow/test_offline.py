"""The whole installation from a folder of packages, as docs/install.md tells it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from pipeline.runtime import ROOT


def test_an_installation_without_a_network(tmp_path: Path) -> None:
    script = "pipeline/workflow/install_lock.py"
    (tmp_path / script).parent.mkdir(parents=True)
    for name in ("Makefile", "requirements.lock", "requirements-dev.lock", script):
        shutil.copy(ROOT / name, tmp_path / name)
    unwanted = {"MAKEFLAGS", "MAKELEVEL", "MFLAGS"}
    environment = {name: value for name, value in os.environ.items() if name not in unwanted}
    nowhere = {"http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}
    python = f"PYTHON={sys.executable}"
    for command, more in (("wheels", {}), ("dev", nowhere)):
        subprocess.run(
            ["make", command, "WHEELS=packages", python],
            cwd=tmp_path,
            env=environment | more,
            check=True,
        )
    subprocess.run(
        [str(tmp_path / ".venv/bin/python"), "-m", "pytest", "tests/workflow/test_imports.py"],
        cwd=ROOT,
        env=environment,
        check=True,
    )
