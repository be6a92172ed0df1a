"""From recordings to the constants of a specimen, with what is known of their errors."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
