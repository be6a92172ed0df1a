"""Maps between specimen and picture: camera, depth, rigid motion, outlines."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
