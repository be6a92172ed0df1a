"""Holds what all solvers share: their interface, loads, batches and checks of inputs."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
