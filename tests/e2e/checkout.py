"""A checkout of this repository with a study so small that the real stages take seconds."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import psutil
import yaml

from pipeline.problem.reading import overlay_keys
from pipeline.runtime import ROOT, RUN_MARK

STUDY = "tiny"
SMALLER = yaml.safe_load("""
title: A small study
lattice: { columns: 5, rows: 5 }
cloak: { disc: { radius: 22 mm } }
drive: { amplitude: 2 mm, directions: [0 deg, 45 deg], weights: [0.5, 0.5] }
horizon: { periods: 1, samples: 20 }
optimiser: { methods: { sqp: { evaluations: 12 }, mma: { evaluations: 12 } } }
solver: { accuracy: draft }
response: { cycles: 1, samples: 21 }
sweep: { grid: { drive.directions: { points: 3 }, drive.frequency: { points: 2 } } }
report: { measured_constants: null, as_built: false }
robustness: null
presets: null
""")
ROOMS = ("benchmarks", "experiments", "metacloak", "pipeline", "profiles", "reports", "sim")
FILES = (
    *("Snakefile", "Makefile", "CITATION.cff", "LICENSE", "README.md", "pyproject.toml"),
    *("setup.py", "requirements.lock", "requirements-dev.lock", "requirements-compiler.lock"),
    ".gitignore",
)
_CACHES = ("JAX_COMPILATION_CACHE_DIR", "MPLCONFIGDIR")
_NOBODYS = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}
_DATED = {"GIT_AUTHOR_DATE": "2025-01-01T00:00:00Z", "GIT_COMMITTER_DATE": "2025-01-01T00:00:00Z"}

Ended = subprocess.CompletedProcess[str]


@dataclass(frozen=True)
class Checkout:
    """A folder that holds the repository, and what a user does there."""

    root: Path
    own_caches: bool = False

    @classmethod
    def made(cls, root: Path) -> Checkout:
        """A copy of the working tree, its study added, committed as a whole."""
        for room in ROOMS:
            shutil.copytree(ROOT / room, root / room, ignore=shutil.ignore_patterns("*.pyc.*"))
        for name in FILES:
            shutil.copy2(ROOT / name, root)
        (root / ".venv").symlink_to(sys.prefix)
        problem = yaml.safe_load((ROOT / "experiments/fig2/problem.yaml").read_text())
        target = root / f"experiments/{STUDY}/problem.yaml"
        target.parent.mkdir()
        target.write_text(yaml.safe_dump(overlay_keys(problem, SMALLER), sort_keys=False))
        made = cls(root)
        made._git("init", "--quiet")
        made._git("add", "--all")
        made._git(
            *("-c", "user.name=Test", "-c", "user.email=test@localhost"),
            *("commit", "--quiet", "--message", "A copy"),
        )
        return made

    def copied(self, root: Path) -> Checkout:
        """Another checkout of the same commit, in which nothing is built."""
        built = shutil.ignore_patterns("results", ".snakemake", ".cache")
        shutil.copytree(self.root, root, symlinks=True, ignore=built)
        return Checkout(root, self.own_caches)

    @property
    def problem(self) -> Path:
        return self.root / f"experiments/{STUDY}/problem.yaml"

    @property
    def results(self) -> Path:
        return self.root / f"results/{STUDY}"

    def edit(self, old: str, new: str, study: str = STUDY) -> None:
        problem = self.root / f"experiments/{study}/problem.yaml"
        text = problem.read_text()
        assert old in text
        problem.write_text(text.replace(old, new, 1))

    def make(self, target: str = STUDY, first: str = "") -> Ended:
        return self._run(["make", *_NO_SETUP, target], first)

    def snakemake(self, *words: str) -> Ended:
        return self._run([".venv/bin/snakemake", *(words or (STUDY,))])

    def stage(self, module: str, *words: str, first: str = "") -> Ended:
        return self.module(
            module, "--problem", f"experiments/{STUDY}/problem.yaml", *words, first=first
        )

    def module(self, module: str, *words: str, first: str = "") -> Ended:
        return self._run([".venv/bin/python", "-m", *module.split(), *words], first)

    def shell(self, commands: str) -> Ended:
        """Commands as a user types them, but for `make` setting up the environment."""
        ready = re.sub("^make ", f"make {' '.join(_NO_SETUP)} ", commands, flags=re.MULTILINE)
        return self._run(["bash", "-euc", ready])

    def script(self, text: str) -> Ended:
        return self._run([".venv/bin/python", "-c", text])

    def start(self, target: str = STUDY) -> subprocess.Popen[str]:
        """`make`, as `begin` begins a command."""
        return self.begin("make", *_NO_SETUP, target)

    def begin(self, *command: str) -> subprocess.Popen[str]:
        """A command in a process group of its own; the output is a pipe."""
        return subprocess.Popen(
            command,
            cwd=self.root,
            env=self._environment(),
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    def built(self, study: str = STUDY) -> dict[str, bytes]:
        """Content of all datasets and of the report, by name."""
        folder = self.root / "results" / study
        paths = [*folder.glob("*.nc"), *folder.glob("report/**/*")]
        return {
            path.relative_to(folder).as_posix(): path.read_bytes()
            for path in sorted(paths)
            if path.is_file()
        }

    def stages(self, name: str) -> list[psutil.Process]:
        """The running Python processes of a stage, e.g. `design`."""
        return [
            process for process in self.jobs() if _words(process)[1:4] == ["-m", "pipeline", name]
        ]

    def jobs(self) -> list[psutil.Process]:
        """All that the workflow of this checkout has started and that still runs."""
        found = []
        for process in psutil.process_iter():
            try:
                if process.environ().get(RUN_MARK, "").startswith(f"{self.root}:"):
                    found.append(process)
            except psutil.Error:
                continue
        return found

    def _git(self, *words: str) -> None:
        environment = os.environ | _NOBODYS | _DATED
        subprocess.run(["git", *words], cwd=self.root, env=environment, check=True)

    def _run(self, command: list[str], first: str = "") -> Ended:
        """Runs a command, by a process that obeys the Python statements `first`."""
        then = "\nimport os, sys\nos.execvp(sys.argv[1], sys.argv[1:])"
        return subprocess.run(
            [sys.executable, "-c", first + then, *command] if first else command,
            cwd=self.root,
            env=self._environment(),
            text=True,
            capture_output=True,
            check=False,
        )

    def _environment(self) -> dict[str, str]:
        """Of a user's shell, not of `make test`; with its own caches, if asked for."""
        unwanted = {"MAKEFLAGS", "MAKELEVEL", "MFLAGS"}
        kept = {name: value for name, value in os.environ.items() if name not in unwanted}
        own = {name: str(self.root / ".cache" / name.lower()) for name in _CACHES}
        return kept | own if self.own_caches else kept


_NO_SETUP = tuple(
    f"--old-file={name}"
    for name in (".venv/requirements.lock", ".venv/requirements-dev.lock", "setup", "dev")
)


def _words(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def wait_until(
    condition: Callable[[], object], run: subprocess.Popen[str], pause: float = 0.001
) -> None:
    """Looks again after every pause (s), as long as the run lasts."""
    end = time.monotonic() + 240
    while not condition():
        assert run.poll() is None, f"ended before the moment came: {run.communicate()[0]}"
        assert time.monotonic() < end, "the moment did not come"
        time.sleep(pause)


def assert_one_message(ended: Ended, *parts: str) -> None:
    """The command failed and said why on one screen, with file, key and remedy."""
    told = ended.stdout + ended.stderr
    assert ended.returncode != 0
    assert told.count("error: ") == 1, told
    assert "Traceback" not in told
    assert "remedy:" in told
    assert len(told.splitlines()) <= 24
    for part in parts:
        assert part in told, told


def assert_plain(text: str) -> None:
    """No bars, colours or other control characters: readable in a file."""
    assert not re.search(r"[^\S\n ]|[\x00-\x09\x0b-\x1f\x7f-\x9f]", text), repr(text)
