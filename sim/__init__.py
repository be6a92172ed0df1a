"""Physics of networks of rigid units joined by elastic ligaments.

Pure functions on arrays: no files, no configuration, no plotting. Units throughout: mm, N, s,
tonne, rad, float64.
"""

import os
import sys

import lazy_loader as lazy

# JAX reads the variable when it is imported; one that was imported before is told.
os.environ["JAX_ENABLE_X64"] = "1"
if "jax" in sys.modules:
    sys.modules["jax"].config.update("jax_enable_x64", True)

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
