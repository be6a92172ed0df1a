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

STAGES = """
design select simulate as_built virtual_specimen sweep monte_carlo verify redesign
film track compare robust_gains
"""

SERVER = """
import os, sys
import PIL.Image, docutils.core, jinja2, pint, pydantic, requests, smart_open, yaml, yte
import snakemake.cli, snakemake.report
for line in sys.stdin:
    root, told, *words = line.rstrip("\\n").split("\\t")
    if not (child := os.fork()):
        for stream, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(f"{told}.{name}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
        os.chdir(root)
        sys.argv[1:] = words
        snakemake.cli.main(words)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
"""Snakemake in a process that has imported it once, and obeys each command in a fork of its own."""


@cache
def _server() -> subprocess.Popen[str]:
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", SERVER], stdin=pipe, stdout=pipe, text=True)


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

    def environment(self) -> dict[str, str]:
        return os.environ | {"STAGE_SECONDS": str(self.stage_seconds)}

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Returns the output of a command of snakemake, and its exit status."""
        told = self.root.with_name("told")
        given = ["--cores", "2", *words]
        server = _server()
        assert server.stdin
        assert server.stdout
        print(self.root, told, *given, sep="\t", file=server.stdin, flush=True)
        code = int(server.stdout.readline())
        out, err = (told.with_suffix(f".{name}").read_text() for name in ("out", "err"))
        return subprocess.CompletedProcess(given, code, out, err)

    def resume(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "pipeline", "run", *words],
            cwd=self.root,
            env=self.environment(),
            text=True,
            capture_output=True,
            check=False,
        )

    def planned(self, *words: str) -> Counter[str]:
        """Counts the jobs of each rule in a plan."""
        ended = self.run("--dry-run", *words)
        said = ended.stdout + ended.stderr
        assert ended.returncode == 0, said
        assert "Exception" not in said
        table = ended.stdout.partition("\n---")[2].partition("\ntotal")[0].splitlines()[1:]
        return Counter({rule: int(count) for rule, count in map(str.split, table)})


@pytest.fixture(scope="session")
def planned_once(tmp_path_factory: pytest.TempPathFactory) -> Sandbox:
    sandbox = _copied(tmp_path_factory.mktemp("planned") / "repository")
    assert sandbox.planned("fig2")  # hashes all sources
    return sandbox


@pytest.fixture
def sandbox(planned_once: Sandbox, tmp_path: Path) -> Sandbox:
    """A repository in which nothing has run."""
    return Sandbox(shutil.copytree(planned_once.root, tmp_path / "repository"))


@pytest.fixture(scope="session")
def built_once(planned_once: Sandbox, tmp_path_factory: pytest.TempPathFactory) -> Sandbox:
    folder = tmp_path_factory.mktemp("built") / "repository"
    sandbox = Sandbox(shutil.copytree(planned_once.root, folder))
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
    for stage in (*(f"pipeline/stages/{name}" for name in STAGES.split()), "reports/__main__"):
        shutil.copy(Path(__file__).with_name("toy_stage.py"), root / f"{stage}.py")
    return Sandbox(root)
