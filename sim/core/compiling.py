"""Compiles loops: once on a machine, however many processes want them at the same time."""

import fcntl
import logging
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from threading import RLock
from typing import Any, TypeVar, cast

from numba import jit, njit
from numba.core import event

from sim.core import borrowed_tuples, code_library, compile_time, loop_cache, remembered_types
from sim.core.code_library import Loop

F = TypeVar("F", bound=Callable[..., Any])

LOG = logging.getLogger(__name__)

_SECONDS_BETWEEN_LINES = 10.0
_HOW: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
loop_cache.install()
code_library.install()
borrowed_tuples.install()
remembered_types.install()

_WITHIN = RLock()
_mine: set[str] = set()
"""Loops that this process compiles now: one, what it calls, what that calls."""


class _Announcement(event.Listener):
    """Tells of loops that are compiled, as opposed to found in the cache."""

    def __init__(self) -> None:
        self._count, self._began, self._told = 0, 0.0, 0.0

    def on_start(self, _: event.Event) -> None:
        """Tells at the first loop, and from then on every ten seconds."""
        now = time.monotonic()
        if not self._count:
            self._began = self._told = now
            LOG.info("compiling loops, once on this machine: up to a minute or two")
        elif now - self._told >= _SECONDS_BETWEEN_LINES:
            self._told = now
            LOG.info("compiling: %d loops in %.0f s", self._count, now - self._began)
        self._count += 1

    def on_end(self, _: event.Event) -> None:
        """Says nothing: the work that follows does."""


event.register("numba:compile", _Announcement())  # type: ignore[no-untyped-call]


def compiled(function: F, **how: Any) -> F:  # noqa: ANN401  (options of Numba)
    """Compiles a loop once, caches it on disk, and runs it without the interpreter's lock.

    A process that wants a loop while another compiles it waits, and finds it in the cache.
    """
    loop = _in_turn(function, _HOW | how)
    loop.__class__, loop.compiler = Loop, _in_turn
    return cast(F, loop)


def _in_turn(function: Callable[..., Any], how: dict[str, Any]) -> Any:  # noqa: ANN401
    loop: Any = jit(**how)(function)
    loop._cache = loop_cache.LoopCache(function)  # type: ignore[no-untyped-call]
    compile_one, name = loop.compile, f"{function.__module__}.{function.__qualname__}"

    def compile_in_turn(signature: object) -> object:
        with _turn(name):
            return compile_one(signature)

    loop.compile = compile_in_turn
    return loop


def inlined(function: F, **how: Any) -> F:  # noqa: ANN401
    """Makes a loop a part of the `compiled` ones that call it, in place of one of its own."""
    return cast(F, njit(inline="always", **_HOW, **how)(function))


@contextmanager
def _turn(loop: str) -> Iterator[None]:
    """Keeps other processes with the same cache from compiling a loop; over when this one dies.

    They cannot wait for one another: who waits for a loop holds only loops that call it.
    """
    with _WITHIN, compile_time.counted(), ExitStack() as taken:
        outermost = not _mine
        if loop not in _mine:
            _mine.add(loop)
            taken.callback(_mine.discard, loop)
            _take(taken, loop)
        yield
        if outermost:
            code_library.pack_all()


def _take(turn: ExitStack, loop: str) -> None:
    """Waits for the turn; where no file can be made or locked, nobody waits for anybody."""
    for folder in loop_cache.cache_folders():
        with suppress(OSError):
            turns = folder / "turns"
            turns.mkdir(parents=True, exist_ok=True)
            fcntl.flock(turn.enter_context((turns / loop).open("w")), fcntl.LOCK_EX)
            return
