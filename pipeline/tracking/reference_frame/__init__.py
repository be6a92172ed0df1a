"""Calibrates the camera on the frame at rest and recognises the specimen there."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
