from __future__ import annotations

import signal

from hypothesis import settings

from pipeline.environment import pin

pin()  # before anything imports the libraries that this is about

# What a shell runs in the background ignores Ctrl-C, and the runs under test would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run, and no deadline: the first one compiles.
settings.register_profile("suite", deadline=None, derandomize=True)
settings.load_profile("suite")
