"""Fits rigid motions to brightness, for all units of a frame at once."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
