"""Holds the scenes of benchmarks: those of the paper, and their load cases."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
