"""Holds what every room shares: types of arrays, errors, and how loops are compiled."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
