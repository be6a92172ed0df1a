"""Compiles loops: once on a machine, however many processes want them at the same time."""

from __future__ import annotations

import fcntl
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from threading import RLock
from typing import Any, TypeVar, cast

from numba import njit

from sim.core import loop_cache

F = TypeVar("F", bound=Callable[..., Any])

_HOW: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
loop_cache.install()

_WITHIN = RLock()
_mine: set[str] = set()
"""Loops that this process compiles now: one, what it calls, what that calls."""


def compiled(function: F, **how: Any) -> F:  # noqa: ANN401  (options of Numba)
    """Compiles a loop once, caches it on disk, and runs it without the interpreter's lock.

    A process that wants a loop while another compiles it waits, and finds it in the cache.
    """
    loop: Any = njit(cache=True, **_HOW, **how)(function)
    compile_one, name = loop.compile, f"{function.__module__}.{function.__qualname__}"

    def compile_in_turn(signature: object) -> object:
        with _turn(name):
            return compile_one(signature)

    loop.compile = compile_in_turn
    return cast(F, loop)


def inlined(function: F, **how: Any) -> F:  # noqa: ANN401
    """Makes a loop a part of the `compiled` ones that call it, in place of one of its own."""
    return cast(F, njit(inline="always", **_HOW, **how)(function))


@contextmanager
def _turn(loop: str) -> Iterator[None]:
    """Keeps other processes with the same cache from compiling a loop; over when this one dies.

    They cannot wait for one another: who waits for a loop holds only loops that call it.
    """
    with _WITHIN, ExitStack() as taken:
        if loop not in _mine:
            _mine.add(loop)
            taken.callback(_mine.discard, loop)
            _take(taken, loop)
        yield


def _take(turn: ExitStack, loop: str) -> None:
    """Waits for the turn; where no file can be made or locked, nobody waits for anybody."""
    with suppress(OSError):
        folder = loop_cache.cache_folder() / "turns"
        folder.mkdir(parents=True, exist_ok=True)
        fcntl.flock(turn.enter_context((folder / loop).open("w")), fcntl.LOCK_EX)
