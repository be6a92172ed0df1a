"""Types of arrays, and how loops over pixels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sim.core import compiling

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Reals = NDArray[np.floating[Any]]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Image = NDArray[np.uint8]
Picture = Image | Singles
"""Brightness from 0 to 255, in steps of one or finer."""

F = TypeVar("F", bound=Callable[..., Any])


_SUMS = {"reassoc", "contract", "arcp", "nsz"}
"""What fast mathematics may do to them."""


def compiled(function: F) -> F:
    """Compiles a loop once and caches it on disk; sums may be reordered, NaN stays NaN.

    What it calls must be `inlined`: sums of a loop of its own would be ordered in one way when the
    caller has just been compiled, and in another when it comes from the cache.
    """
    return compiling.compiled(function, fastmath=_SUMS)


def inlined(function: F) -> F:
    """Makes a loop a part of the `compiled` ones that call it."""
    return compiling.inlined(function, fastmath=_SUMS)
