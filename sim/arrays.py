"""Types of the arrays that sim/ works on, all of 64 bits."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from jax import Array
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Numbers: TypeAlias = Array | Floats
"""What a JAX function takes; it returns ``Array``."""
