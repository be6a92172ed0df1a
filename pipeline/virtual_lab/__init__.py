"""Films simulated specimens, so that cameras and marks are tried before filming."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
