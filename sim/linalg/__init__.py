"""Factorises and solves symmetric sparse systems: banded, by panels or by nested dissection."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
