"""Holds the parts of a specimen, before they are laid on sheets and plates."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
