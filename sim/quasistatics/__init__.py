"""Follows equilibria along a load path by Newton's method, with its adjoint."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
