import ctypes
import gc
import os
import signal
import sys
from pathlib import Path

import psutil
import pytest
from hypothesis import HealthCheck, settings

from pipeline.runtime import pin

pin()  # before anything imports the libraries that this is about
# What is tested in this process runs but a few times: XLA's optimiser took a quarter of the
# processor's time in tests of shapes and of what can be made (85 s without this line, 65 with it).
# The processes that tests start pin their own flags, and run as they do for users.
os.environ["XLA_FLAGS"] += " --xla_backend_optimization_level=0"

# What a shell runs in the background ignores Ctrl-C, and the runs under test would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run, and no limits of time: the first one compiles, machines are busy.
settings.register_profile(
    "suite", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("suite")

LARGE, GROWTH = 1000 << 20, 150 << 20
"""Bytes from which a process drops what JAX has compiled, and by which it has to grow till then."""
_process, _kept = psutil.Process(), [0]

gc.disable()  # what is imported to collect tests stays: nothing to look through, now or later


FIRST = (
    *("workflow", "docs", "reports", "test_gradients.py"),
    *("e2e", "test_contact_solves.py", "solvers"),
)
"""Files and folders that are begun first, as some take a minute: they keep no worker at the end.
Before those that compile most loops come some that compile none, while a build beside the tests
(`.ci/run`) compiles: who wants a loop that another compiles waits for it."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def place(item: pytest.Item) -> int:
        names = item.path.relative_to(Path(__file__).parent).parts
        return min((FIRST.index(name) for name in names if name in FIRST), default=len(FIRST))

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
        gc.collect()
        ctypes.CDLL(None).malloc_trim(0)
        _kept[0] = _process.memory_info().rss
