"""Types of the arrays that sim/ works on, all of 64 bits."""

from __future__ import annotations

from typing import TypeAlias

import jax
import numpy as np
from jax import Array
from numpy.typing import NDArray

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Numbers: TypeAlias = Array | Floats
"""What a JAX function takes; it returns ``Array``."""
