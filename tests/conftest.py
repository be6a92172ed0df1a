from __future__ import annotations

import signal

from hypothesis import HealthCheck, settings

from pipeline.runtime import pin

pin()  # before anything imports the libraries that this is about

# What a shell runs in the background ignores Ctrl-C, and the runs under test would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run, and no limits of time: the first one compiles, machines are busy.
settings.register_profile(
    "suite", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("suite")
