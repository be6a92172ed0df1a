"""Spans a family of loads, searches its worst one, and designs against it."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
