"""Compiles loops over pixels, and names the type of a picture."""

from collections.abc import Callable
from typing import Any, TypeVar

from sim.core import Image, Singles, compiling

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


def uncounted(function: F) -> F:
    """Compiles a loop likewise that allocates no arrays, and counts no references to any.

    Each view of an array is counted, in one instruction that locks a processor's bus.
    """
    return compiling.compiled(function, fastmath=_SUMS, _nrt=False)


def inlined(function: F) -> F:
    """Makes a loop a part of the `compiled` ones that call it."""
    return compiling.inlined(function, fastmath=_SUMS)
