from __future__ import annotations

from hypothesis import settings

from pipeline.environment import pin

pin()  # before anything imports the libraries that this is about

# The same examples in every run, and no deadline: the first one compiles.
settings.register_profile("suite", deadline=None, derandomize=True)
settings.load_profile("suite")
