"""Physics of networks of rigid units joined by elastic ligaments.

Pure functions on arrays: no files, no configuration, no plotting. Units throughout: mm, N, s,
tonne, rad, float64.
"""

import os
import sys

# JAX reads the variable when it is imported; one that was imported before is told.
os.environ["JAX_ENABLE_X64"] = "1"
if "jax" in sys.modules:
    sys.modules["jax"].config.update("jax_enable_x64", True)
