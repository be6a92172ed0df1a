"""Tells the workflow what to build: studies, recordings, inputs of rules."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
