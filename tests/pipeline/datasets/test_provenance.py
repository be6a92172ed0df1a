import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.datasets import provenance
from pipeline.problem import from_canonical, section_hash
from pipeline.problem.reading import load
from pipeline.runtime import ROOT
from sim.core.instruction_set import LEVEL, LIBRARIES, can_pin


def test_attributes_tell_where_a_dataset_comes_from(fig2: Path) -> None:
    problem = load(fig2)
    told = provenance.of_study(
        problem, "simulate", parents={"design": fig2}, plan={"skipped": ["reference"]}
    )
    assert all(isinstance(value, str) for value in told.values())
    assert told["problem_hash"] == section_hash(problem, "simulate")
    assert from_canonical(told["problem"]).response == problem.response
    assert json.loads(told["parents"]) == {"design": provenance.file_hash(fig2)}
    assert json.loads(told["plan"]) == {"skipped": ["reference"]}
    assert json.loads(told["packages"])["numpy"]
    assert provenance.of_study(problem, "simulate")["plan"] == "{}"
    turned = {"a": [2], "b": 1}, {"b": 1, "a": [2]}
    plans = [provenance.of_study(problem, "simulate", plan=plan)["plan"] for plan in turned]
    assert plans[0] == plans[1]
    told = provenance.of_study(load(fig2), "design", method="mma")
    assert list(from_canonical(told["problem"]).optimiser.methods.chosen) == ["mma"]


def test_no_commit_outside_a_checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provenance, "ROOT", tmp_path)
    provenance.git_commit.cache_clear()
    assert provenance.git_commit() == "unknown"
    provenance.git_commit.cache_clear()


def test_the_commit_of_a_repository_around_the_sources_is_none_of_theirs(tmp_path: Path) -> None:
    words = ["git", "-C", str(tmp_path), "-c", "user.name=T", "-c", "user.email=t@localhost"]
    subprocess.run([*words, "init", "--quiet"], check=True)
    assert provenance.head_commit(tmp_path) == ""  # nothing is committed yet
    subprocess.run([*words, "commit", "--quiet", "--allow-empty", "--message", "One"], check=True)
    assert len(provenance.head_commit(tmp_path)) >= 40
    (tmp_path / "own/cloak").mkdir(parents=True)
    assert provenance.head_commit(tmp_path / "own/cloak") == ""


def test_a_missing_package_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provenance, "PACKAGES", ("no-such-package",))
    provenance.package_versions.cache_clear()
    assert provenance.package_versions()["no-such-package"] == "absent"
    provenance.package_versions.cache_clear()


def test_the_hash_of_a_folder_goes_by_names_and_contents(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    for folder in (first, second):
        folder.mkdir()
        (folder / "0.png").write_bytes(b"one")
        (folder / "1.png").write_bytes(b"two")
    assert provenance.file_hash(first) == provenance.file_hash(second)
    (second / "1.png").rename(second / "2.png")
    renamed = provenance.file_hash(second)
    (second / "2.png").write_bytes(b"other")
    assert len({provenance.file_hash(first), renamed, provenance.file_hash(second)}) == 3


LATE = """
import {first}
from pipeline.datasets import provenance
import scipy.linalg
from sim.quasistatics import newton
print(provenance.instructions())
"""


@pytest.mark.skipif(not can_pin(), reason="this processor lacks the level")
@pytest.mark.parametrize("first", ["pipeline", "numpy"])
def test_instructions_are_those_that_were_loaded(first: str) -> None:
    words = [sys.executable, "-c", LATE.format(first=first)]
    clean = {name: value for name, value in os.environ.items() if name not in LIBRARIES}
    told = subprocess.run(words, cwd=ROOT, env=clean, capture_output=True, text=True, check=True)
    late = first == "numpy" and "avx512f" in Path("/proc/cpuinfo").read_text()
    assert (told.stdout.strip() == LEVEL) is not late
    assert ("NumPy X86_V4" in told.stdout) is late
