"""Starts snakemake so that it goes on after any kind of end.

A `kill -9` may leave jobs running, here or on a cluster. They are ended first, and snakemake then
continues what is incomplete. Runs that build other studies in the same folder are left alone.
"""

import ctypes
import os
import signal
import sys
from typing import NoReturn

import psutil

from pipeline.runtime import INSTALLED, ROOT, RUN_MARK, WORK, UserError, streams
from pipeline.workflow.rule_inputs import check_problems
from pipeline.workflow.runs import SNAKEMAKE, Run, stale_jobs, study_lock, write_access

_PATIENCE = 5.0  # seconds that a left-over job gets to end by itself
_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl(2)


def work(arguments: list[str]) -> NoReturn:
    """Checks the problem files of the targets, clears what a killed run left, runs snakemake."""
    streams.complete()
    os.chdir(WORK)
    check_problems(arguments)
    try:
        write_access.check(WORK)
        _clear_the_ground()
    except UserError as error:
        sys.exit(f"error: {error}")
    _end_with_make()
    os.execv(sys.executable, [*SNAKEMAKE, *_places(), *arguments])


def _places() -> list[str]:
    """Options that name Snakefile and profile, where they are not in the folder of the work."""
    if not INSTALLED:
        return []
    places = {"--snakefile": ROOT / "Snakefile", "--workflow-profile": ROOT / "profiles/default"}
    return [str(word) for option in places.items() for word in option]


def _clear_the_ground() -> None:
    """Ends left-over jobs of killed runs.

    Raises:
        UserError: jobs on a cluster may be those of another run, or the cluster does not answer.
    """
    if left := stale_jobs.remaining(WORK):
        study_lock.check_free(WORK)  # afterwards: a run holds its locks before it has jobs
        stale_jobs.cancel(WORK, left)
    for number in left:
        print(f"cancelled job {number} of a killed run", file=sys.stderr)  # noqa: T201
    orphans = [process for process in _others() if _is_left_over(process)]
    for process in orphans:
        process.terminate()
    _, stubborn = psutil.wait_procs(orphans, timeout=_PATIENCE)
    for process in stubborn:
        process.kill()


def _others() -> list[psutil.Process]:
    """Lists all processes but this one and those that started it."""
    this = psutil.Process()
    own = {this, *this.parents()}
    return [process for process in psutil.process_iter() if process not in own]


def _is_left_over(process: psutil.Process) -> bool:
    """Tells whether a process is a job of a run in this folder and on this host that has ended."""
    try:
        folder, _, name = process.environ().get(RUN_MARK, "").rpartition(":")
    except psutil.Error:  # it is not ours, or has ended
        return False
    run = Run.parse(name)
    return folder == str(WORK) and run is not None and run.here and not run.may_live


def _end_with_make() -> None:
    """Asks Linux to kill this process with the `make` that began it: it leaves no snakemake.

    A run that a shell left in the background outlives the shell.
    """
    if "MAKELEVEL" in os.environ and sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
