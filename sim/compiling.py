"""How loops are compiled: once on a machine, however many processes want them at the same time."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import RLock
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])

_WITHIN = RLock()
_depth = 0


def compiled(function: F, **how: Any) -> F:  # noqa: ANN401  (options of Numba)
    """Compiles a loop once, caches it on disk, and runs it without the interpreter's lock.

    A process that wants the loop while another compiles it waits, and finds it in the cache.
    """
    loop: Any = njit(cache=True, nogil=True, error_model="numpy", **how)(function)
    compile_one = loop.compile

    def compile_in_turn(signature: object) -> object:
        with _turn():
            return compile_one(signature)

    loop.compile = compile_in_turn
    return cast(F, loop)


@contextmanager
def _turn() -> Iterator[None]:
    """Keeps other processes with the same cache from compiling; over when this one dies, too."""
    global _depth  # noqa: PLW0603  (loops that call loops are compiled within one turn)
    with _WITHIN, ExitStack() as taken:
        if not _depth:
            _take(taken)
        _depth += 1
        try:
            yield
        finally:
            _depth -= 1


def _take(turn: ExitStack) -> None:
    """Waits for the turn; where no file can be made or locked, nobody waits for anybody."""
    if not (cache := os.environ.get("NUMBA_CACHE_DIR")):
        return
    with suppress(OSError):
        folder = Path(cache)
        folder.mkdir(parents=True, exist_ok=True)
        fcntl.flock(turn.enter_context((folder / "compiling.lock").open("w")), fcntl.LOCK_EX)
