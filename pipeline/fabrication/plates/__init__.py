"""Lays parts on sheets for the laser cutter and plates for the printer."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
