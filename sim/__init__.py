"""Physics of networks of rigid units joined by elastic ligaments.

Pure functions on arrays: no files, no configuration, no plotting. Units throughout: mm, N, s,
tonne, rad, float64.
"""

import jax

# here, so that whatever room is entered first has it
jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]
