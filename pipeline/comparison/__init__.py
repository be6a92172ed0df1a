"""A recording beside the simulation of what it shows: common frame and axis, metrics, verdicts."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
