"""Reads problem files: YAML with line numbers, presets, checks of what can be built."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
