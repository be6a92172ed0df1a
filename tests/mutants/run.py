"""Runs tests against mutants of the source, in a copy of the working tree; counts the survivors.

``make mutants`` draws 200 and writes results/mutants.json. Modules come from the rooms below, each
tried by the tests of its own room, those of its own name first, until one fails. What is heavy is
imported once; each mutant gets a fork.
"""

import argparse
import importlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NoReturn

ROOT = Path(__file__).resolve().parents[2]
ROOMS = {
    "sim/structure": "tests/sim/structure",
    "sim/constraints": "tests/sim/constraints",
    "sim/optimise": "tests/sim/optimise",
    "sim/linalg": "tests/sim/linalg",
    "sim/energy": "tests/sim/energy",
    "pipeline/problem": "tests/pipeline/problem",
    "pipeline/datasets": "tests/pipeline/datasets",
    "pipeline/runtime": "tests/pipeline/runtime",
    "pipeline/comparison": "tests/pipeline/comparison",
    "pipeline/fabrication": "tests/pipeline/fabrication",
    "reports/facts": "tests/reports/facts",
    "reports/page": "tests/reports/page",
}
"""Folders of the source, and of their tests."""
HEAVY = (
    *("jax", "jax.numpy", "scipy.optimize", "xarray", "netCDF4", "pydantic", "pint"),
    *("hypothesis", "pytest", "matplotlib.pyplot", "shapely", "cv2", "ezdxf", "trimesh"),
)
"""Packages to import once."""
PROJECT = ("sim", "pipeline", "reports", "benchmarks", "tests", "metacloak")
LONGEST, BUDGET = 15.0, 25.0
"""Seconds of CPU that a file of tests may take unchanged, and all of a module's."""
ENDS = {0: "survived", 1: "killed", 2: "killed", 4: "killed"}
"""By the exit code of pytest: some fail, or a module cannot be imported."""


@dataclass(frozen=True)
class Ended:
    """Tells how a run of tests ended: its exit code, negative for a signal, and seconds of CPU."""

    code: int
    seconds: float


def run(root: Path, tests: Sequence[str], limit: float) -> Ended:
    """Runs files of tests in a fork, up to the first that fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    child = os.fork() or _child(root, tests, limit)
    began, code = time.monotonic(), None
    while code is None:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            code = os.waitstatus_to_exitcode(status)
        elif time.monotonic() - began > 20 * limit:
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.02)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Ended(code, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def _child(root: Path, tests: Sequence[str], limit: float) -> NoReturn:
    os.setsid()
    os.chdir(root)
    log = os.open(root.with_name("log"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(log, stream)
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 5))
    import pytest

    for name in [each for each in sys.modules if each.partition(".")[0] in PROJECT]:
        del sys.modules[name]
    os._exit(int(pytest.main(["-n0", "-x", "-q", "-p", "no:cacheprovider", *tests])))


@cache
def matching(root: Path, path: str) -> tuple[tuple[str, ...], float]:
    """Chooses the tests of a module, and tells how many seconds of CPU they take unchanged."""
    room = _room(path)
    stem = Path(path).stem
    files = sorted(
        (root / ROOMS[room]).rglob("test_*.py"), key=lambda each: (stem not in each.stem, each)
    )
    chosen, total = [], 0.0
    for file in map(str, files):
        seconds = _unchanged(root, file)
        if seconds <= LONGEST and total + seconds <= BUDGET:
            chosen.append(file)
            total += seconds
    return tuple(chosen), total


@cache
def _unchanged(root: Path, file: str) -> float:
    """Returns the seconds of CPU of a file of tests; infinitely many where it fails."""
    ended = run(root, [file], 4 * LONGEST)
    if ended.code:
        sys.stderr.write(f"left out, as it ends with {ended.code} unchanged: {file}\n")
    return float("inf") if ended.code else ended.seconds


def _room(path: str) -> str:
    return "/".join(Path(path).parts[:2])


def tried(root: Path, mutant: dict[str, str]) -> dict[str, object]:
    """Writes a mutant over its module, runs the tests, and puts the module back."""
    path = root / mutant["path"]
    tests, seconds = matching(root, mutant["path"])
    if not tests:
        return {"path": mutant["path"], "operator": mutant["operator"], "end": "no quick tests"}
    good, times = path.read_bytes(), path.stat()
    path.write_text(mutant["code"], encoding="utf-8")
    os.utime(path, (times.st_atime, times.st_mtime + 10))  # its bytecode is not that of before
    try:
        ended = run(root, tests, 5 * seconds + 30)
    finally:
        path.write_bytes(good)
        os.utime(path, (times.st_atime, times.st_mtime))
    end = ENDS.get(ended.code, "ended" if ended.code > 0 else "hung")
    return {
        "path": mutant["path"],
        "operator": mutant["operator"],
        "end": end,
        "change": _change(good.decode(), mutant["code"]),
    }


def _change(good: str, mutated: str) -> str:
    from difflib import unified_diff

    lines = unified_diff(good.splitlines(), mutated.splitlines(), n=0, lineterm="")
    return "\n".join(list(lines)[2:])


def drawn(root: Path, python: str, seed: int, count: int) -> Iterator[dict[str, str]]:
    """Yields mutants of the rooms' modules as they are drawn."""
    rooms = [
        path
        for room in ROOMS
        for path in sorted((root / room).rglob("*"))
        if path.suffix in (".py", ".c")
    ]
    modules = [str(path.relative_to(root)) for path in rooms if path.name != "__init__.py"]
    command = [python, str(Path(__file__).with_name("draw.py")), str(seed), str(count), *modules]
    with subprocess.Popen(command, cwd=root, text=True, stdout=subprocess.PIPE) as drawing:
        yield from map(json.loads, drawing.stdout or ())


def copied(root: Path) -> None:
    """Copies the files that git knows."""
    command = ["git", "ls-files"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    for name in listed.stdout.splitlines():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, root / name)


def main() -> int:
    """Draws mutants, tries them one by one, and writes what became of each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cosmic-ray", required=True, help="Python that has cosmic-ray")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=ROOT / "results/mutants.json")
    asked = parser.parse_args()
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder, "copy")
        os.environ["XDG_CACHE_HOME"] = str(Path(folder, "caches"))  # of mutants of C
        copied(root)
        sys.path.insert(0, str(root))
        importlib.import_module("pipeline.runtime").pin()
        for name in HEAVY:
            importlib.import_module(name)
        for mutant in drawn(root, asked.cosmic_ray, asked.seed, asked.count):
            found.append(tried(root, mutant))
            sys.stderr.write(f"{len(found)} {found[-1]['end']}: {found[-1]['path']}\n")
            asked.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    for room in ROOMS:
        ends = Counter(each["end"] for each in found if _room(str(each["path"])) == room)
        sys.stderr.write(f"{room}: {dict(ends)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
