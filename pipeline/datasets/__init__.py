"""The datasets between the stages: their schemas, and the only way to write and read them."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
