"""The problem file: typed, with units, checked. `load` is the way in."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
