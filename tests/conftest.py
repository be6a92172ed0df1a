from __future__ import annotations

import signal

import pytest
from hypothesis import HealthCheck, settings

from pipeline.environment import pin

pin()  # before anything imports the libraries that this is about

# What a shell runs in the background ignores Ctrl-C, and the runs under test would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run, and no limits of time: the first one compiles, machines are busy.
settings.register_profile(
    "suite", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("suite")


def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    """Tests of a file run in one process; those of a study that `make` builds once, too."""
    for item in items:
        shared = "undisturbed" in item.fixturenames
        group = "undisturbed" if shared else item.nodeid.partition("::")[0]
        item.add_marker(pytest.mark.xdist_group(group))
