"""Draws Figures 4 to 6: structures along a path of loads."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
