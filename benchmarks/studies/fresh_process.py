"""Runs in a process that compiles its loops anew; nothing that loads Numba is imported before.

The constants of compiled loops are part of their machine code, so a change of one needs this too.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import TemporaryDirectory

from benchmarks.harness import Run, Sample, Task
from benchmarks.scenes import scene
from benchmarks.studies.scene_loss import loss_by_solver
from sim.quasistatics import newton
from sim.scene import make_plan
from sim.time_integration import esdirk_stage


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
    return loss_by_solver(name, make_plan(scene(name)).solver)
