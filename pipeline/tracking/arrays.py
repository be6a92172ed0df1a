"""Types of arrays, and how loops over pixels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Reals = NDArray[np.floating[Any]]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Image = NDArray[np.uint8]
Picture = Image | Singles
"""Brightness from 0 to 255, in steps of one or finer."""

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compiles a loop once and caches it on disk; sums may be reordered, NaN stays NaN."""
    fast = {"reassoc", "contract", "arcp", "nsz"}
    made = njit(cache=True, nogil=True, error_model="numpy", fastmath=fast)(function)
    return cast(F, made)
