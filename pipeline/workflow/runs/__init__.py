"""Tells runs that live from those that were killed, and keeps them apart."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
