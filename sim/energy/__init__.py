"""Defines the energy of ligaments and contact, and compiles its derivatives."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
