"""Bounds designs that can be made: edges, angles and gaps, with sparse derivatives."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
