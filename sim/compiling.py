"""How loops are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compiles a loop once, caches it on disk, and runs it without the interpreter's lock."""
    return cast(F, njit(cache=True, nogil=True, error_model="numpy")(function))
