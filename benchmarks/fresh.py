"""Runs in a process that compiles its loops anew; nothing that loads Numba is imported before.

The constants of compiled loops are part of their machine code, so a change of one needs this too.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import TemporaryDirectory

from benchmarks.climb import Task
from benchmarks.frame import Run, Sample


def compilation(name: str, skipped: float, task: Task) -> Run:
    """The first result of a process, with its loops from the disk or compiled for it."""
    del task

    def run() -> Sample:
        if skipped:
            return _default(name)()
        with _no_cache():
            return _default(name)()

    return run


def factors(name: str, skipped: float, task: Task) -> Run:
    """Factors kept while they converge, or a new one for every Newton step."""
    del task
    if skipped:
        return _default(name)
    with _no_cache():
        from sim import esdirk_stage, newton

        esdirk_stage.REFACTOR_ABOVE = 0.0
        newton.KEEP_FACTOR = newton.RENEW_FACTOR = 0.0
        return _default(name)


@contextmanager
def _no_cache() -> Iterator[None]:
    """An empty folder for what is compiled. Numba reads where it is as it is imported."""
    with TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = folder
        yield


def _default(name: str) -> Run:
    """The loss by the scene's own plan."""
    from benchmarks.ladders.cases import scene
    from benchmarks.scene_loss import loss
    from sim.plan import make_plan

    return loss(name, make_plan(scene(name)).solver)
