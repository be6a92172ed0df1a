"""Counts the time that a process spends on compiling loops or waits for others that do.

It says nothing about how long the work takes, so whoever tells of progress leaves it out.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager

_spent = 0.0
_since: list[float] = []
"""Start times (s) of the compilations under way, one within another."""


@contextmanager
def counted() -> Iterator[None]:
    """Counts the time of a block; that of a block within another one is not counted twice."""
    global _spent  # noqa: PLW0603
    _since.append(time.monotonic())
    try:
        yield
    finally:
        began = _since.pop()
        if not _since:
            _spent += time.monotonic() - began


def working_time() -> float:
    """Reads a clock, in s, that stands still while loops are compiled."""
    now = time.monotonic()
    return now - _spent - (now - _since[0] if _since else 0.0)
