"""Compiles the solver anew in a process of its own, where no library of it is loaded before.

The constants of its loops are part of its machine code, so a change of one needs this too.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import TemporaryDirectory
from typing import Literal

from benchmarks import methods, scenes
from benchmarks.harness import Run, Sample, Task
from sim import scene as sim_scene


def compilation(name: str, skipped: float, _: Task) -> Run:
    """Times the first result of a process, with the solver from the disk or compiled for it."""

    def run() -> Sample:
        if skipped:
            return _default(name)()
        with _no_cache():
            return _default(name)()

    return run


def factors(name: str, skipped: float, _: Task) -> Run:
    """Keeps factors while they converge, or makes a new one for every Newton step.

    On implicit steps, whichever the plan chooses: explicit ones have no factors.
    """
    if skipped:
        return _default(name, integrator="implicit")
    with _no_cache():
        os.environ["METACLOAK_CFLAGS"] = "-DNO_KEPT_FACTORS"
        return _default(name, integrator="implicit")


@contextmanager
def _no_cache() -> Iterator[None]:
    """Lends an empty folder to what is compiled."""
    with TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        yield


def _default(name: str, integrator: Literal["auto", "implicit"] = "auto") -> Run:
    """Prepares the loss by the scene's own plan."""
    solver = sim_scene.make_plan(scenes.scene(name).updated(integrator=integrator)).solver
    return methods.warmed_up(methods.loss_run(scenes.case(name), solver))
