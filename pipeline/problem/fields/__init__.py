"""Reads single values: numbers with units, and the base of all sections."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
