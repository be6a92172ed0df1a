"""Loops are compiled once, by whichever process wants them first."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.runtime import ROOT
from tests.tables import some

LOOPS = """
from sim.core.compiling import compiled

@compiled
def inner(n):
    total = 0.0
    for k in range(n):
        total += k % 7
    return total

@compiled
def outer(n):
    return inner(n) + inner(n + 1)

@compiled
def another(n):
    return 2 * inner(n)
"""
WANT = """
import loops
loops.outer(3)
print(sum(loops.outer.stats.cache_misses.values()), loops.outer(3))
"""


@pytest.mark.parametrize("writable", some([True, False], 1))
def test_processes_that_want_a_loop_at_once_compile_it_once(tmp_path: Path, writable: bool) -> None:
    (tmp_path / "loops.py").write_text(LOOPS)
    cache = tmp_path / "cache" if writable else tmp_path / "loops.py" / "none"
    places = {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "NUMBA_CACHE_DIR": str(cache)}
    want = [sys.executable, "-c", WANT]
    asking = [
        subprocess.Popen(want, env=os.environ | places, text=True, stdout=subprocess.PIPE)
        for _ in range(3)
    ]
    told = [each.communicate(timeout=120)[0].split() for each in asking]
    assert [each.returncode for each in asking] == [0, 0, 0]
    assert {value for _, value in told} == {"9.0"}
    compiled = sum(int(misses) for misses, _ in told)
    assert compiled == 1 or (not writable and compiled <= 3)  # Numba has other places for its cache


COUNT = """
import logging, sys, time
logging.basicConfig(level=logging.INFO, stream=sys.stdout, format="%(message)s")
from sim.core import working_time
import loops
began, worked = time.monotonic(), working_time()
loops.outer(3)
print(time.monotonic() - began, working_time() - worked)
"""


def once(folder: Path, script: str) -> list[str]:
    """Runs a script that calls the loops, which are compiled in that folder; returns its lines."""
    (folder / "loops.py").write_text(LOOPS)
    places = {"PYTHONPATH": f"{ROOT}{os.pathsep}{folder}", "NUMBA_CACHE_DIR": str(folder)}
    run = [sys.executable, "-c", script]
    told = subprocess.check_output(run, env=os.environ | places, text=True, timeout=120)
    return told.splitlines()


def twice(folder: Path, script: str) -> tuple[list[str], list[str]]:
    """Runs a script before and after its loop is compiled; returns what it prints."""
    return once(folder, script), once(folder, script)


def test_compiling_is_told_once_and_does_not_count_as_work(tmp_path: Path) -> None:
    first, second = twice(tmp_path, COUNT)
    assert first[0] == "compiling loops, once on this machine: up to a minute or two"
    assert all(line.startswith("compiling: ") for line in first[1:-1])  # where it takes long
    passed, worked = map(float, first[-1].split())
    assert worked < 0.5 * passed  # a pause of the machine beside the compiling counts as work
    assert len(second) == 1  # found in the cache


MACHINE_CODE = """
import loops
print(loops.outer(3), loops.outer.stats.cache_misses.total())
(part,) = loops.inner.callee.overloads.values() if loops.inner.callee.overloads else [None]
print(part and part.library._has_machine_code, bool(loops.inner.overloads))
print(loops.inner(3), loops.inner.overloads[loops.inner.signatures[0]].library._has_machine_code)
"""


def test_only_what_python_calls_has_machine_code(tmp_path: Path) -> None:
    first, second = twice(tmp_path, MACHINE_CODE)
    assert first == ["9.0 1", "False False", "3.0 True"]
    assert second == ["9.0 0", "None False", "3.0 True"]  # none of it is even read


PACKED = """
import loops
loops.outer(3)
(part,) = loops.inner.callee.overloads.values()
library = part.library
print(library._module, library._shared_module, loops.another(3), library._module)
print(library.get_pointer_to_function(part.fndesc.llvm_func_name) != 0, library._has_machine_code)
"""


def test_code_that_was_packed_is_linked_with_and_becomes_machine_code(tmp_path: Path) -> None:
    assert once(tmp_path, PACKED) == ["None None 6.0 None", "True True"]


INLINED = """
import sys
import numpy as np
from numba.core.inline_closurecall import InlineWorker
of_numba = InlineWorker.inline_function
from sim.core.compiling import compiled, inlined
if sys.argv[1:] == ["copied"]:
    InlineWorker.inline_function = of_numba

@inlined
def innermost(values, k):
    return values[k] * 2.0 if k % 2 else 1.0

@inlined
def inner(values):
    total = 0.0
    for k in range(len(values)):
        total += innermost(values, k) - innermost(values, 0)
    return total

@compiled
def outer(values):
    return inner(values) + inner(values[1:])

print(outer(np.arange(5.0)))
print(*outer.inspect_llvm().values())
"""


def test_what_is_inlined_without_copies_is_the_same_code(tmp_path: Path) -> None:
    (tmp_path / "loops.py").write_text(INLINED)
    told = []
    for how in ("copied", "as it is"):
        places = {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / how)}
        run = [sys.executable, str(tmp_path / "loops.py"), how]
        told.append(subprocess.check_output(run, env=os.environ | places, text=True, timeout=120))
    assert told[0].startswith("16.0\n")  # by hand
    assert told[0] == told[1]
