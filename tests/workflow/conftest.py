"""A copy of the repository whose stages only pretend: the workflow without the work."""

import os
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from pipeline.runtime import ROOT

STAGES = (
    "pipeline/stages/design",
    "pipeline/stages/select",
    "pipeline/stages/simulate",
    "pipeline/stages/virtual_specimen",
    "pipeline/stages/sweep",
    "pipeline/stages/monte_carlo",
    "pipeline/stages/verify",
    "pipeline/stages/redesign",
    "pipeline/stages/film",
    "pipeline/stages/track",
    "pipeline/stages/compare",
    "reports/__main__",
)


PLANNER = """
import os, sys
import pint, pydantic, snakemake.cli, yaml
for line in sys.stdin:
    root, told, *words = line.rstrip("\\n").split("\\t")
    if not (child := os.fork()):
        out = os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1), os.dup2(out, 2), os.chdir(root)
        snakemake.cli.main(words)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
"""Snakemake in a process that has imported it once, and makes each plan in a fork of its own."""


@cache
def _planner() -> subprocess.Popen[str]:
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", PLANNER], stdin=pipe, stdout=pipe, text=True)


@dataclass
class Sandbox:
    """A copied repository to run snakemake in."""

    root: Path
    stage_seconds: float = 0.0

    @property
    def problem(self) -> Path:
        return self.root / "experiments/fig2/problem.yaml"

    def edit(self, old: str, new: str) -> None:
        text = self.problem.read_text()
        assert old in text
        self.problem.write_text(text.replace(old, new, 1))

    def command(self, *words: str) -> list[str]:
        return [str(Path(sys.executable).with_name("snakemake")), "--cores", "2", *words]

    def environment(self) -> dict[str, str]:
        return os.environ | {"STAGE_SECONDS": str(self.stage_seconds)}

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        return self._ended(self.command(*words))

    def resume(self, *words: str) -> subprocess.CompletedProcess[str]:
        return self._ended([sys.executable, "-m", "pipeline", "run", *words])

    def planned(self, *words: str) -> Counter[str]:
        """How often each rule would run."""
        told = self.root.with_name("plan.txt")
        server = _planner()
        assert server.stdin
        assert server.stdout
        print(self.root, told, "--cores", "2", "--dry-run", *words, sep="\t", file=server.stdin)
        server.stdin.flush()
        assert server.stdout.readline() == "0\n", told.read_text()
        table = told.read_text().partition("\n---")[2].partition("\ntotal")[0].splitlines()[1:]
        return Counter({rule: int(count) for rule, count in map(str.split, table)})

    def _ended(self, command: list[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command,
            cwd=self.root,
            env=self.environment(),
            text=True,
            capture_output=True,
            check=False,
        )


@pytest.fixture
def sandbox(tmp_path: Path) -> Sandbox:
    """A repository in which nothing has run."""
    return _copied(tmp_path / "repository")


@pytest.fixture(scope="session")
def built_once(tmp_path_factory: pytest.TempPathFactory) -> Sandbox:
    sandbox = _copied(tmp_path_factory.mktemp("built") / "repository")
    ended = sandbox.run("fig2")
    assert ended.returncode == 0, ended.stderr
    return sandbox


@pytest.fixture
def built(built_once: Sandbox, tmp_path: Path) -> Sandbox:
    """A repository in which fig2 was built."""
    return Sandbox(shutil.copytree(built_once.root, tmp_path / "repository"))


def _copied(root: Path) -> Sandbox:
    for folder in ("benchmarks", "experiments", "pipeline", "profiles", "reports", "sim"):
        shutil.copytree(ROOT / folder, root / folder, ignore=shutil.ignore_patterns("*.pyc.*"))
    shutil.copy(ROOT / "Snakefile", root)
    for stage in STAGES:
        shutil.copy(Path(__file__).with_name("toy_stage.py"), root / f"{stage}.py")
    return Sandbox(root)
