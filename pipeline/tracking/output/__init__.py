"""Writes tracks as datasets and tables, and fields of displacement points."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
