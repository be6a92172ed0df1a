import ctypes
import gc
import os
import signal
import sys

import psutil
import pytest
from hypothesis import HealthCheck, settings
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

from pipeline.runtime import pin

pin()  # before anything imports the libraries that this is about
# What is tested in this process runs but a few times: most of the time that JAX takes in tests of
# shapes and of what can be made is XLA's, to optimise and to emit (cold 49 s without the second
# flag, 30 with it). The processes that tests start pin their own flags, and run as for users.
os.environ["XLA_FLAGS"] += " --xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false"

# What a shell runs in the background ignores Ctrl-C, and the runs under test would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run, and no limits of time: the first one compiles, machines are busy.
settings.register_profile(
    "suite", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("suite")

# On Linux all threads share two arenas, and what is freed goes back to the system: else each thread
# keeps free memory of its own, and workers grow by a fifth. Numbers of mallopt(3).
_ARENA_MAX, _MMAP_THRESHOLD, _TRIM_THRESHOLD = -8, -3, -1
if sys.platform == "linux" and hasattr(ctypes.CDLL(None), "mallopt"):
    for parameter, value in (
        (_ARENA_MAX, 2),
        (_MMAP_THRESHOLD, 1 << 20),
        (_TRIM_THRESHOLD, 16 << 20),
    ):
        ctypes.CDLL(None).mallopt(parameter, value)

LARGE, GROWTH = 700 << 20, 150 << 20
"""Bytes from which a process drops what JAX has compiled, and by which it has to grow till then."""
_process, _kept = psutil.Process(), [0]
_frozen = [0]  # objects: a stage that is imported keeps all that there is, garbage too

gc.disable()  # what is imported to collect tests stays: nothing to look through, now or later
gc.set_threshold(20_000, 20, 50)  # JAX makes so much that a process looked through it 14 000 times


FIRST = (
    *("workflow", "docs", "reports", "sim/solvers", "e2e"),
    *("pipeline/tracking", "sim/scene", "pipeline/fabrication"),
)
"""Folders that are begun first, as they take a minute and more: they keep no process at the end.
Before those that compile most loops come some that compile none, while a build beside the tests
(`.ci/run`) compiles: who wants a loop that another compiles waits for it."""


def folder_of(nodeid: str) -> str:
    """The folder whose tests one process runs; those of `reports` are one.

    They share what takes long to make: fixtures of a session, functions that JAX has compiled.
    """
    above = nodeid.partition("::")[0].split("/")[1:-1]
    return "/".join(above[: 1 if "reports" in above else 2])


class ByFolder(LoadScopeScheduling):  # type: ignore[misc]
    """Gives folders to processes, in the order of collection."""

    def _split_scope(self, nodeid: str) -> str:
        return folder_of(nodeid)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> ByFolder | None:
    return ByFolder(config, log) if config.getvalue("dist") == "loadscope" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def place(item: pytest.Item) -> int:
        folder = folder_of(item.nodeid)
        return FIRST.index(folder) if folder in FIRST else len(FIRST)

    items.sort(key=place)
    for item in items:
        if item.path.parent.name == "slow":
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown() -> None:
    if "jax" in sys.modules and _process.memory_info().rss > max(LARGE, _kept[0] + GROWTH):
        sys.modules["jax"].clear_caches()
        if gc.get_freeze_count() > _frozen[0]:
            gc.unfreeze()
            gc.collect()
            gc.freeze()
            _frozen[0] = gc.get_freeze_count()
        else:
            gc.collect()
        ctypes.CDLL(None).malloc_trim(0)
        _kept[0] = _process.memory_info().rss
