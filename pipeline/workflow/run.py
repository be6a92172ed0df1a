"""Starts snakemake so that it goes on after any kind of end.

A `kill -9` leaves a lock in the folder and may leave jobs running, here or on a cluster. They are
cleared first, unless another snakemake is at work here; snakemake itself then continues what is
incomplete.
"""

import ctypes
import os
import shutil
import signal
import sys
from pathlib import Path
from typing import NoReturn

import psutil

from pipeline.runtime import INSTALLED, ROOT, RUN_MARK, WORK, UserError, streams
from pipeline.workflow import stale_jobs
from pipeline.workflow.rule_inputs import check_problems

_PATIENCE = 5.0  # seconds that a left-over job gets to end by itself
_PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl(2)


def work(arguments: list[str]) -> NoReturn:
    """Checks the problem files of the targets, clears what a killed run left, runs snakemake."""
    streams.complete()
    os.chdir(WORK)
    check_problems(arguments)
    try:
        _clear_the_ground()
    except UserError as error:
        sys.exit(f"error: {error}")
    _end_with_parent()
    snakemake = str(Path(sys.executable).with_name("snakemake"))
    os.execv(snakemake, [snakemake, *_places(), *arguments])


def _places() -> list[str]:
    """Options that name Snakefile and profile, where they are not in the folder of the work."""
    if not INSTALLED:
        return []
    places = {"--snakefile": ROOT / "Snakefile", "--workflow-profile": ROOT / "profiles/default"}
    return [str(word) for option in places.items() for word in option]


def _clear_the_ground() -> None:
    """Ends left-over jobs and removes the lock of a killed run.

    Raises:
        UserError: a snakemake is at work in this folder, or the cluster does not answer.
    """
    active = [process for process in _others() if _is_snakemake(process)]
    if active:
        raise UserError(
            f"snakemake is already at work in this folder (process {active[0].pid})",
            file=WORK,
            remedy=f"wait for it, or end it with: kill -INT {active[0].pid}",
        )
    for number in stale_jobs.cancel(WORK):
        print(f"cancelled job {number} of a killed run", file=sys.stderr)  # noqa: T201
    orphans = [process for process in _others() if _mark(process) == str(WORK)]
    for process in orphans:
        process.terminate()
    _, stubborn = psutil.wait_procs(orphans, timeout=_PATIENCE)
    for process in stubborn:
        process.kill()
    shutil.rmtree(WORK / ".snakemake/locks", ignore_errors=True)


def _others() -> list[psutil.Process]:
    """Lists all processes but this one and those that started it."""
    this = psutil.Process()
    own = {this, *this.parents()}
    return [process for process in psutil.process_iter() if process not in own]


def _is_snakemake(process: psutil.Process) -> bool:
    """Tells whether the process is a snakemake in this folder."""
    try:
        names = {Path(word).name for word in process.cmdline()[:2]}
        return "snakemake" in names and Path(process.cwd()) == WORK
    except psutil.Error:
        return False


def _mark(process: psutil.Process) -> str | None:
    """Reads for which folder a job runs; None if the process is no job or is not ours."""
    try:
        return process.environ().get(RUN_MARK)
    except psutil.Error:
        return None


def _end_with_parent() -> None:
    """Asks Linux to kill this process with its parent: a killed `make` leaves no snakemake."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
