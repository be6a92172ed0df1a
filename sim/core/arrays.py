"""Defines the types of arrays, all of 64 bits where nothing else is said."""

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from jax import Array

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Mask: TypeAlias = NDArray[np.bool_]
Singles: TypeAlias = NDArray[np.float32]
Reals: TypeAlias = NDArray[np.floating[Any]]
Image: TypeAlias = NDArray[np.uint8]
Numbers: TypeAlias = "Array | Floats"
"""Argument of a JAX function; it returns ``Array``."""
